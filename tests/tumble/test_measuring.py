"""From a dataset to a verdict on the command line: estimate, score, report, gate, and the quickstart that strings them together."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib import resources
from pathlib import Path

import pytest

from datasets.errors import InputError
from datasets.estimate_files import read_estimate, write_estimate
from datasets.scoring.score import truth_as_estimate
from datasets.truth_files import read_truth
from tumble.cli import quickstart
from tumble.cli.main import main
from tumble.configuring import load_configuration

ROOT = Path(__file__).resolve().parents[2]
SMALL = ["--set", "motion.frames=12", "--set", "rig.drops=2", "--set", "motion.speed_ms=[1.0, 2.0]", "-q"]
ESTIMATE_ALONE = """
import sys
for name in ("mitsuba", "drjit"):
    sys.modules[name] = None
from tumble.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("measuring") / "dataset"
    assert main(["render", *SMALL, "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def estimates(dataset: Path) -> Path:
    out = dataset.parent / "estimates"
    assert main(["estimate", str(dataset), "--out", str(out), "-q"]) == 0
    return out


@pytest.fixture(scope="module")
def perfect(dataset: Path) -> Path:
    """The truth, handed in as estimates."""
    out = dataset.parent / "perfect"
    for folder in (dataset / "truth").iterdir():
        write_estimate(truth_as_estimate(read_truth(folder)), out / f"{folder.name}.estimate.json")
    return out


def test_an_estimate_needs_neither_truth_nor_mitsuba(dataset: Path, estimates: Path, tmp_path: Path) -> None:
    shutil.copytree(dataset / "observations", tmp_path / "observations")
    words = [sys.executable, "-c", ESTIMATE_ALONE, "estimate", str(tmp_path), "--out", str(tmp_path / "estimates"), "-q"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (expected,) = estimates.glob("*.estimate.json")
    assert (tmp_path / "estimates" / expected.name).read_bytes() == expected.read_bytes()


def test_estimate_says_what_came_out_and_what_to_type_next(dataset: Path, estimates: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["estimate", str(dataset), "--out", str(estimates), "--resume"]) == 0
    out = capsys.readouterr().out
    (path,) = estimates.glob("*.estimate.json")
    estimate = read_estimate(path)
    assert estimate.name in out
    assert estimate.status.value in out
    assert f"tumble score {estimates} --truth {dataset / 'truth'}" in out


def test_scores_of_the_truth_itself_are_zero(dataset: Path, perfect: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["score", str(perfect), "--truth", str(dataset / "truth"), "--out", str(tmp_path / "s"), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    (row,) = summary["rows"]
    assert row["middle_in_plane_ms"] == row["middle_angular_rads"] == row["orientation_max_deg"] == 0.0
    assert summary["worse_sequences"] == []
    assert [(entry["rmse"], entry["rms_bound"] > 0, entry["n"]) for entry in summary["efficiency"]] == [(0.0, True, 1)] * 3
    assert [entry["coverage"] for entry in summary["ellipsoids"]] == [1.0] * 4
    assert (tmp_path / "s" / "scores.csv").read_text(encoding="utf-8").startswith("sequence,")
    assert json.loads((tmp_path / "s" / "scores.json").read_text(encoding="utf-8")) == summary


def test_errors_are_said_over_the_bound(dataset: Path, perfect: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["score", str(perfect), "--truth", str(dataset / "truth"), "--out", str(tmp_path / "s")]) == 0
    assert "omega: RMSE 0 rad/s, 0.00 times the bound of the true body" in " ".join(capsys.readouterr().out.split())


def test_a_worse_sequence_is_named_with_its_cause(dataset: Path, perfect: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (path,) = perfect.glob("*.estimate.json")
    lost = json.loads(path.read_text(encoding="utf-8")) | {"status": "ambiguous"}
    del lost["sha256"]
    (tmp_path / path.name).write_text(json.dumps(lost), encoding="utf-8")
    assert main(["score", str(tmp_path), "--truth", str(dataset / "truth"), "--out", str(tmp_path / "s")]) == 0
    assert f"worse: {lost['name']}: ambiguous" in capsys.readouterr().out


def test_a_worse_sequence_whose_estimate_says_that_something_is_missing_is_named_so(
    dataset: Path, perfect: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (path,) = perfect.glob("*.estimate.json")
    exact = read_estimate(path)
    assert exact.middle is not None
    tested = {"adequate": False, "p": 1e-9, "statistic": 90.0, "freedom": 18, "component": "path along x", "after_impacts": 0}
    tested |= {"component_rms": 1e-4, "component_p": 1e-9, "noise_ratio": 1.0}
    off = replace(exact.middle, v_world=1.02 * exact.middle.v_world)
    write_estimate(replace(exact, middle=off, statistics={"adequacy": tested}), tmp_path / path.name)
    assert main(["score", str(tmp_path), "--truth", str(dataset / "truth"), "--out", str(tmp_path / "s")]) == 0
    assert f"worse: {exact.name}: model misses something" in capsys.readouterr().out
    assert "misfit" in (tmp_path / "s" / "scores.csv").read_text(encoding="utf-8").splitlines()[0]


def test_a_report_finds_the_observations_by_itself(
    dataset: Path, estimates: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(estimates), "--truth", str(dataset / "truth"), "--out", str(tmp_path / "r"), "--json"]) == 0
    page = Path(json.loads(capsys.readouterr().out)["report"])
    assert '"seen":"' in page.read_text(encoding="utf-8")


def test_quickstart_runs_every_verb_and_can_be_repeated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    recipe = 'sequences = 1\ntier = "silhouette"\n[motion]\nframes = 30\n[rig]\ndrops = 4\n'

    monkeypatch.setattr(quickstart, "recipe", lambda: recipe)
    assert main(["quickstart", "--out", str(tmp_path / "demo")]) == 0
    out = capsys.readouterr().out
    assert [f"$ tumble {verb} " in out for verb in ("render", "estimate", "score", "report")] == [True] * 4
    assert f"The report: {tmp_path / 'demo' / 'report' / 'report.html'}" in out
    assert main(["quickstart", "--out", str(tmp_path / "demo"), "--resume", "-q"]) == 0
    (tmp_path / "demo" / "demo.toml").write_text(f"{recipe}# mine", encoding="utf-8")
    assert main(["quickstart", "--out", str(tmp_path / "demo"), "--force"]) == 2
    assert "got one that was changed since" in capsys.readouterr().err
    assert (tmp_path / "demo" / "demo.toml").read_text(encoding="utf-8").endswith("# mine")


def test_the_demo_recipe_is_part_of_the_package() -> None:
    assert resources.files("tumble").joinpath(quickstart.RECIPE).is_file()


def test_nothing_to_estimate_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["estimate", str(tmp_path), "--out", str(tmp_path / "e")]) == 2
    assert "expected a dataset or an observation" in capsys.readouterr().err
    assert not (tmp_path / "e").exists()


def test_configuration_is_resolved_and_checked(tmp_path: Path) -> None:
    file = tmp_path / "c.toml"
    file.write_text("minimum_frames = 9\nseed = 4\n", encoding="utf-8")
    resolved = load_configuration(file, ["seed=5"])
    assert (resolved["minimum_frames"], resolved["seed"]) == (9, 5)
    assert "hull_resolution" in resolved
    for bad in ("minimum_frame=9", "seed", "seed=x"):
        with pytest.raises(InputError, match="expected"):
            load_configuration(None, [bad])


def test_a_truncated_recording_is_named_and_loses_no_neighbour(dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (whole,) = (dataset / "observations").iterdir()
    for name in ("a", "b"):
        shutil.copytree(whole, tmp_path / "observations" / name)
    cut = tmp_path / "observations" / "a" / "outlines_hsv.npz"
    cut.write_bytes(cut.read_bytes()[:200])
    assert main(["estimate", str(tmp_path), "--out", str(tmp_path / "e"), "--jobs", "1", "-q"]) == 1
    error = capsys.readouterr().err
    assert "a failed" in error
    assert "outlines_hsv.npz" in error
    assert [path.name for path in (tmp_path / "e").glob("*.estimate.json")] == ["b.estimate.json"]
