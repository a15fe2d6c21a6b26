"""``tumble gate`` with a baseline alone: its sequences are made anew, what is still valid stays, a planted fault is named."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from datasets.errors import InputError
from estimator.fitting import refinement, tasks
from scripts.gate_demonstration import body_axes
from tumble import estimating, gating
from tumble.cli.main import main

RECIPE = """
name = "gate"
seed = 401
sequences = 2
[particle]
irregularity = 0.6
size_mm = [5.0, 7.0]
[motion]
frames = 25
speed_ms = [1.5, 3.0]
spin_rads = [100.0, 250.0]
[rig]
drops = 3
"""


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recipe, the baseline written from it, and the work folder of that run."""
    folder = tmp_path_factory.mktemp("gate")
    (folder / "small.toml").write_text(RECIPE, encoding="utf-8")
    words = ["gate", str(folder / "small.json"), "--recipe", str(folder / "small.toml"), "--out", str(folder / "work"), "--jobs", "1", "-q"]
    assert main([*words, "--write"]) == 0
    return folder


def gate(kept: Path, *more: str, work: str) -> int:
    return main(["gate", str(kept / "small.json"), "--out", str(kept / work), "--jobs", "1", *more])


def counted(monkeypatch: pytest.MonkeyPatch, module: Any, name: str) -> list[Any]:
    calls: list[Any] = []
    original: Callable[..., Any] = getattr(module, name)

    def call(*arguments: Any, **settings: Any) -> Any:
        calls.append(arguments)
        return original(*arguments, **settings)

    monkeypatch.setattr(module, name, call)
    return calls


def test_the_baseline_names_its_recipe_beside_it(kept: Path) -> None:
    assert json.loads((kept / "small.json").read_text(encoding="utf-8"))["recipe"] == "small.toml"


def test_the_same_estimator_passes_and_what_is_there_is_kept(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert gate(kept, work="work") == 0  # another test may have left estimates of other sources there
    (lost, other) = sorted((kept / "work" / "estimates").glob("*.estimate.json"))
    before = lost.read_bytes()
    lost.unlink()
    estimated = counted(monkeypatch, estimating, "measure")
    assert gate(kept, work="work") == 0
    assert [observation.name for observation, _ in estimated] == [lost.name.removesuffix(".estimate.json")]
    assert lost.read_bytes() == before
    assert other.exists()
    assert json.loads((kept / "work" / "verdict.json").read_text(encoding="utf-8"))["worse"] is False


def test_a_fault_in_the_estimator_is_exit_code_1_and_names_the_sequences(kept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with body_axes():
        assert gate(kept, work="fault") == 1
    out = capsys.readouterr().out
    assert "middle_angular_percent: worse by" in out
    assert "cut_stone-0000" in out
    assert "cut_stone-0001" in out


def test_estimates_of_other_sources_are_made_anew(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = gating.sources_digest
    assert original(gating.NATURE) != original(gating.INSTRUMENT)
    monkeypatch.setattr(gating, "sources_digest", lambda packages: original(packages) + ("+" if "estimator" in packages else ""))
    rendered, estimated = counted(monkeypatch, gating, "render_dataset"), counted(monkeypatch, estimating, "measure")
    first = next((kept / "work" / "dataset" / "finished").iterdir()).stat().st_mtime_ns
    assert gate(kept, work="work") == 0
    assert next((kept / "work" / "dataset" / "finished").iterdir()).stat().st_mtime_ns == first
    assert (len(rendered), len(estimated)) == (1, 2)


def test_an_estimate_that_fails_makes_the_run_worse(
    kept: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    original = refinement.refine

    def breaks_once(*arguments: Any, **settings: Any) -> Any:
        monkeypatch.setattr(tasks, "refine", original)
        raise ZeroDivisionError("planted")

    monkeypatch.setattr(tasks, "refine", breaks_once)
    assert gate(kept, "--json", work="failure") == 1
    said = json.loads(capsys.readouterr().out)
    assert said["sequences"] == ["cut_stone-0000"]
    assert said["sentences"][0] == "cut_stone-0000 failed: ZeroDivisionError: planted"
    run = json.loads((kept / "failure" / "run.json").read_text(encoding="utf-8"))
    assert (run["state"], run["failures"][0]["item"]) == ("finished_with_failures", "cut_stone-0000")


def test_a_baseline_without_a_recipe_says_what_to_give(kept: Path, tmp_path: Path) -> None:
    document = json.loads((kept / "small.json").read_text(encoding="utf-8"))
    del document["recipe"], document["sha256"]
    (tmp_path / "b.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InputError, match=r'b\.json: expected "recipe".*came none\. Give --estimates and --truth'):
        gating.recipe_file(tmp_path / "b.json")
    (tmp_path / "b.json").write_text(json.dumps({**document, "recipe": "gone.toml"}), encoding="utf-8")
    with pytest.raises(InputError, match=r"expected its recipe .*gone\.toml, came nothing"):
        gating.recipe_file(tmp_path / "b.json")


def test_estimates_without_truth_are_refused(kept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gate(kept, "--estimates", str(kept / "work" / "estimates"), work="none") == 2
    assert "--estimates and --truth together" in capsys.readouterr().err
