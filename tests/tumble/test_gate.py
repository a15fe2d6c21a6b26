"""``tumble gate``: sequences are made anew, what is valid stays, a planted fault is named with where to look, bad input is refused."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.estimate_files import read_estimate, write_estimate
from datasets.scoring.gate import load_baseline, write_baseline
from estimator.fitting import refinement, tasks
from tests.tumble.made_up import CAMPAIGN_OF_A_SET
from tumble import estimating
from tumble.challenge import solving
from tumble.cli.main import main
from tumble.gate import running
from tumble.gate.sets import case_of, read_set

pytestmark = pytest.mark.long

SET = """
name = "small"
[flights]
seed = 401
sequences = 2
particle = { irregularity = 0.6, size_mm = [5.0, 7.0] }
motion = { frames = 25, speed_ms = [1.5, 3.0], spin_rads = [100.0, 250.0] }
rig = { drops = 3 }
"""
SET += CAMPAIGN_OF_A_SET


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a set, the baseline written from it, and the work folder of that run."""
    folder = tmp_path_factory.mktemp("gate")
    (folder / "small.toml").write_text(SET, encoding="utf-8")
    words = ["gate", str(folder / "small.json"), "--set", str(folder / "small.toml"), "--out", str(folder / "work"), "--jobs", "1", "-q"]
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


def spoiled_run(kept: Path, tmp_path: Path, change: Callable[[Any], Any]) -> Path:
    """A copy of the work folder in which the estimates of all flights are changed."""
    shutil.copytree(kept / "work", tmp_path / "run")
    for path in (tmp_path / "run" / "flights" / "estimates").glob("*.estimate.json"):
        write_estimate(change(read_estimate(path)), path)
    return tmp_path / "run"


def test_the_baseline_says_what_it_was_made_from(kept: Path) -> None:
    document = json.loads((kept / "small.json").read_text(encoding="utf-8"))
    assert document["set"] == "small.toml"
    assert document["made_from"]["recipes"]["flights"]["motion"]["frames"] == 25
    assert {kind: len(rows) for kind, rows in document["kinds"].items()} == {"flights": 2, "campaigns": 1}
    assert all(row["measured"] for rows in document["kinds"].values() for row in rows)


def test_the_same_estimator_passes_and_what_is_there_is_kept(
    kept: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (lost, other) = sorted((kept / "work" / "flights" / "estimates").glob("*.estimate.json"))
    before = lost.read_bytes()
    lost.unlink()
    estimated, solved = counted(monkeypatch, estimating, "measure"), counted(monkeypatch, solving, "solved")
    assert gate(kept, work="work") == 0
    assert [observation.name for observation, _ in estimated] == [lost.name.removesuffix(".estimate.json")]
    assert solved == []
    assert lost.read_bytes() == before
    assert other.exists()
    verdict = json.loads((kept / "work" / "verdict.json").read_text(encoding="utf-8"))
    assert verdict["worse"] is False
    assert {kind: each["verdict"] for kind, each in verdict["kinds"].items()} == {"flights": "same", "campaigns": "same"}
    said = capsys.readouterr().out
    assert "flights: same (2 sequences" in said
    assert "No worsening shown; errors may be 3 times and more the baseline's (campaigns: " in said
    assert "Fewer than 6 sequences of flights and campaigns: only gross faults show there." in said


def test_what_got_worse_is_exit_code_1_with_its_sequences_links_and_what_to_type(
    kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = spoiled_run(kept, tmp_path, lambda e: replace(e, middle=replace(e.middle, v_world=e.middle.v_world + 1.0)))
    assert gate(kept, "--run", str(run), work="worse") == 1
    out = capsys.readouterr().out
    assert "error of v in depth: worse" in out
    assert "look at cut_stone-0000" in out
    assert "next: tumble estimate" in out
    page = (kept / "worse" / "gate.html").read_text(encoding="utf-8")
    assert "flights: worse (2 sequences)" in page
    assert 'href="' in page
    assert 'estimates/cut_stone-0001.estimate.json">cut_stone-0001</a>' in page


def test_a_fault_is_found_and_its_reports_are_made(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = estimating.measure

    def mixed(observation: Any, configuration: Any) -> Any:
        estimate = original(observation, configuration)
        assert estimate.middle is not None
        return replace(estimate, middle=replace(estimate.middle, omega_world=-estimate.middle.omega_world))

    monkeypatch.setattr(estimating, "measure", mixed)
    assert gate(kept, work="fault") == 1
    page = (kept / "fault" / "gate.html").read_text(encoding="utf-8")
    assert 'href="flights/report/report.html"' in page
    assert (kept / "fault" / "flights" / "report" / "report.html").is_file()


def test_cpu_time_is_told_only_of_what_was_measured_whole_on_the_same_platform(
    kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def times(baseline: Path, work: str) -> dict[str, Any]:
        capsys.readouterr()
        assert main(["gate", str(baseline), "--out", str(kept / work), "--jobs", "1", "--json", "--set", str(kept / "small.toml")]) == 0
        return {kind: each["cpu_s"] for kind, each in json.loads(capsys.readouterr().out)["kinds"].items()}

    whole = times(kept / "small.json", "timed")
    assert {kind: sorted(each) for kind, each in whole.items()} == {"flights": ["baseline", "now"], "campaigns": ["baseline", "now"]}
    next((kept / "timed" / "flights" / "estimates").glob("*.estimate.json")).unlink()
    assert times(kept / "small.json", "timed") == {"flights": {}, "campaigns": {}}
    baseline = load_baseline(kept / "small.json")
    write_baseline(tmp_path / "other.json", replace(baseline, environment={**baseline.environment, "platform": "Other-cpu"}))
    assert times(tmp_path / "other.json", "timed-elsewhere") == {"flights": {}, "campaigns": {}}


def test_estimates_of_other_sources_are_made_anew(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(kept / "work", kept / "sources")
    original = running.sources_digest
    assert original(running.NATURE) != original(running.INSTRUMENT)
    monkeypatch.setattr(running, "sources_digest", lambda packages: original(packages) + ("+" if "estimator" in packages else ""))
    estimated = counted(monkeypatch, estimating, "measure")
    made = kept / "sources" / "flights" / "dataset" / "finished"
    first = next(made.iterdir()).stat().st_mtime_ns
    assert gate(kept, work="sources") == 0
    assert next(made.iterdir()).stat().st_mtime_ns == first
    assert len(estimated) == 2


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
    assert said["failed"] == {"flights/cut_stone-0000": "ZeroDivisionError: planted"}
    run = json.loads((kept / "failure" / "run.json").read_text(encoding="utf-8"))
    assert (run["state"], run["failures"][0]["item"]) == ("finished_with_failures", "flights/cut_stone-0000")


def test_numbers_that_are_none_are_infinitely_worse(kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = spoiled_run(kept, tmp_path, lambda e: replace(e, middle=replace(e.middle, v_world=np.full(3, np.nan))))
    assert gate(kept, "--run", str(run), work="none") == 1
    said = capsys.readouterr().out
    assert "error of v in the picture's plane: worse" in said
    assert "not measured any more: cut_stone-0000 (converged, but no number for the error of v in the picture's plane)" in said


def test_an_estimate_of_another_sequence_is_refused(kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = spoiled_run(kept, tmp_path, lambda e: replace(e, name="cut_stone-0001"))
    assert gate(kept, "--run", str(run), work="mixed") == 2
    said = capsys.readouterr().err
    assert 'expected the estimate of sequence "cut_stone-0000", got that of "cut_stone-0001"' in said
    assert "cut_stone-0000.estimate.json" in said


def rewritten(path: Path, **changes: Any) -> None:
    path.write_text(json.dumps({**json.loads(path.read_text(encoding="utf-8")), **changes}), encoding="utf-8")


@pytest.mark.parametrize("write", [False, True])
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("seed = 401", "seed = 402", r"flights/dataset/run\.json: expected a run of the set, but seed was 402 there and is 401 in the set"),
        (
            "per_length = 0.5",
            "per_length = 0.4",
            r"campaigns/truth/run\.json: .*campaigns\.drag\.hidden\.quadratic_drag\.per_length was 0\.4",
        ),
    ],
)
def test_a_run_of_another_set_with_the_same_names_is_refused(
    write: bool, old: str, new: str, said: str, kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The run is given another baseline's set in its run.json, as if it had been made from it."""
    run = spoiled_run(kept, tmp_path, lambda e: e)
    for path in (run / "flights" / "dataset" / "run.json", run / "campaigns" / "truth" / "run.json"):
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace(old.replace(" = ", '": '), new.replace(" = ", '": ')), encoding="utf-8")
    words = ["--write", "--set", str(kept / "small.toml")] if write else []
    before = (kept / "small.json").read_bytes()
    assert gate(kept, "--run", str(run), *words, work=f"refused-{write}-{new}") == 2
    assert re.search(said, capsys.readouterr().err)
    assert (kept / "small.json").read_bytes() == before


def test_estimates_of_another_dataset_and_folders_of_no_run_are_refused(
    kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = spoiled_run(kept, tmp_path, lambda e: e)
    path = run / "flights" / "estimates" / "run.json"
    path.write_text(path.read_text(encoding="utf-8").replace('"seed": 401', '"seed": 402'), encoding="utf-8")
    assert gate(kept, "--run", str(run), work="other-dataset") == 2
    assert "flights/estimates/run.json: expected a run of the set, but seed was 402" in capsys.readouterr().err
    path.unlink()
    assert gate(kept, "--run", str(run), work="no-run") == 2
    assert "flights/estimates/run.json: expected what an earlier gate wrote about its run, got none" in capsys.readouterr().err


def test_what_an_earlier_run_lacks_counts_as_failed(kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = spoiled_run(kept, tmp_path, lambda e: e)
    assert gate(kept, "--run", str(run), work="whole") == 0
    (run / "flights" / "estimates" / "cut_stone-0001.estimate.json").unlink()
    rewritten(run / "campaigns" / "answers" / "run.json", state="unfinished")
    rewritten(run / "flights" / "dataset" / "run.json", failures=[{"item": "cut_stone-0000", "reason": "killed"}])
    capsys.readouterr()
    assert gate(kept, "--run", str(run), "--json", work="lacking") == 1
    failed = json.loads(capsys.readouterr().out)["failed"]
    assert sorted(failed) == ["campaigns/answers", "flights/cut_stone-0000", "flights/cut_stone-0001"]
    assert "got no such file" in failed["flights/cut_stone-0001"]
    assert failed["campaigns/answers"] == "expected a finished run, got one that is unfinished"
    words = ["--write", "--set", str(kept / "small.toml"), "--run", str(run)]
    before = (kept / "small.json").read_bytes()
    assert gate(kept, *words, work="lacking-written") == 2
    assert "could not be measured, so no baseline is written" in capsys.readouterr().err
    assert (kept / "small.json").read_bytes() == before


def test_a_set_that_has_changed_is_refused_with_the_difference(kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "other.toml").write_text(SET.replace("seed = 401", "seed = 402"), encoding="utf-8")
    assert gate(kept, "--set", str(tmp_path / "other.toml"), work="other") == 2
    assert "recipes.flights.seed was 401 and is now 402" in capsys.readouterr().err


def test_a_baseline_that_is_older_than_a_key_of_recipes_has_its_default(kept: Path, tmp_path: Path) -> None:
    document = json.loads((kept / "small.json").read_text(encoding="utf-8"))
    assert document["made_from"]["recipes"]["flights"]["rig"].pop("calibration_px") == 0.0
    del document["sha256"]
    (tmp_path / "small.json").write_text(json.dumps(document), encoding="utf-8")
    shutil.copy(kept / "small.toml", tmp_path / "small.toml")
    assert main(["gate", str(tmp_path / "small.json"), "--run", str(kept / "work"), "--out", str(tmp_path / "out"), "-q"]) == 0


def test_a_run_is_not_resumed_with_other_settings(kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "other.toml").write_text(SET.replace("rows = 30", "rows = 31"), encoding="utf-8")
    words = ["gate", str(tmp_path / "b.json"), "--set", str(tmp_path / "other.toml"), "--write", "--out", str(kept / "work")]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "--resume needs the same run, but configuration.campaigns.drag.rows was 30 and is now 31" in said
    assert not (tmp_path / "b.json").exists()


def test_a_baseline_without_its_set_says_what_to_give(kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "b.json").write_text((kept / "small.json").read_text(encoding="utf-8"), encoding="utf-8")
    assert main(["gate", str(tmp_path / "b.json"), "--out", str(tmp_path / "out")]) == 2
    assert "small.toml, got no such file. Name it with --set" in capsys.readouterr().err
    assert main(["gate", str(tmp_path / "new.json"), "--write", "--out", str(tmp_path / "out")]) == 2
    assert "expected --set FILE.toml with the sequences of a new baseline" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[flights]", "[swims]", "expected name, flights, pictures, impacts and campaigns, got swims"),
        (SET[SET.index("[flights]") :], "", "expected at least one of flights, pictures, impacts and campaigns, got none"),
        ('measured = "positions"', 'measured = "smells"', r'campaigns\[0\]\.measured: expected one of "poses", .*, got "smells"'),
        ("quadratic_drag =", "drag =", "expected an effect of the catalogue, got drag"),
        ("per_length =", "lengths =", r"campaigns\[0\]\.hidden\.quadratic_drag: expected per_length, got lengths"),
        ("rows = 30", "lines = 30", r'unknown key "campaigns\[0\]\.lines"'),
        ("name =", "name", "expected TOML"),
        ('name = "drag"', 'name = "../x"', r'campaigns\[0\]\.name: expected a name that a folder can have, .*, got "\.\./x"'),
        (
            "hidden = { quadratic_drag = { per_length = 0.5 } }",
            "hidden = { quadratic_drag = 3 }",
            "hidden.quadratic_drag: expected a table, got 3",
        ),
        ("hidden = { quadratic_drag = { per_length = 0.5 } }", "hidden = 3", "hidden: expected a table, got 3"),
        ("per_length = 0.5", "per_length = nan", "hidden.quadratic_drag.per_length: expected a finite number, got NaN"),
        ("per_length = 0.5", "per_length = inf", "hidden.quadratic_drag.per_length: expected a finite number"),
        ("flights = 3", "flights = 2.5", r"campaigns\[0\]\.flights: expected an integer, got 2\.5"),
        ("flights = 3", "flights = 0", r"campaigns\[0\]\.flights: expected at least 1, got 0"),
        ("rows = 30", "rows = true", r"campaigns\[0\]\.rows: expected an integer, got true"),
        ("seed = 13", "seed = -1", r"campaigns\[0\]\.seed: expected at least 0, got -1"),
        ("seed = 401", 'seed = "x"', 'flights: seed: expected an integer, got "x"'),
        ('name = "drag"\n', "", r"campaigns\[0\]: expected a value for name"),
        (SET, "campaigns = 3", r"campaigns: expected tables, each under \[\[campaigns\]\], got 3"),
        (SET, "campaigns = [3]", r"campaigns\[0\]: expected a table, got 3"),
        (SET, "flights = 3", r"flights: expected a recipe as a table, \[flights\], got 3"),
    ],
)
def test_sets_that_are_none_are_refused(old: str, new: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "set.toml").write_text(SET.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        read_set(tmp_path / "set.toml")


def test_a_set_that_is_none_leaves_nothing_behind(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "set.toml").write_text(SET.replace("flights = 3", "flights = 2.5"), encoding="utf-8")
    words = ["gate", str(tmp_path / "b.json"), "--set", str(tmp_path / "set.toml"), "--write", "--out", str(tmp_path / "out")]
    assert main(words) == 2
    assert "set.toml: campaigns[0].flights: expected an integer, got 2.5" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["set.toml"]


def test_what_is_hidden_does_not_hang_on_the_estimator() -> None:
    """Sizes are written down: a change of the estimator leaves the sequences as they are."""
    gate_set = read_set(Path(__file__).resolve().parents[2] / "baselines" / "quick.toml")
    case = case_of(gate_set.campaigns[0])
    assert case.hidden == {"quadratic_drag": {"per_length": (0.024,) * 6}}
    assert case.flights == case_of(gate_set.campaigns[0]).flights
    assert case.mess == {}
