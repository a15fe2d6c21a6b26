"""A small field challenge through the command line: made, solved where no truth exists, scored."""

import json
from pathlib import Path

import pandas as pd
import pytest

from datasets.recipes.effects import KNOWN
from datasets.trajectory_files import read_trajectory, trajectories_in
from tumble.challenge.field_case import TRAJECTORIES, read_field_cases
from tumble.cli import main as command_line

TABLES = ("cases", "hidden", "probabilities", "parameters", "velocities", "reliability")


def tumble(*words: str | Path) -> int:
    return command_line.main(["challenge", *(str(word) for word in words)])


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three campaigns of few flights, and answers found where the truth tree does not exist."""
    root = tmp_path_factory.mktemp("field")
    small = ["--campaigns", "3", "--most-flights", "3", "--most-rows", "16", "--seed", "5", "--jobs", "1", "-q"]
    small += ["--measured", ",".join(TRAJECTORIES)]
    assert tumble("make", "--field", "--out", root / "made", *small) == 0
    (root / "made" / "truth").rename(root / "elsewhere")
    assert tumble("solve", root / "made", "--out", root / "answers", "--jobs", "1", "-q") == 0
    (root / "elsewhere").rename(root / "made" / "truth")
    return root


def test_campaigns_give_nothing_away(root: Path) -> None:
    cases = read_field_cases(root / "made")
    seeds = [str(case.seed) for case in cases]
    files = [path for path in (root / "made" / "campaigns").rglob("*") if path.is_file()]
    assert len(files) == sum(len(case.flights) + 1 for case in cases)
    for path in files:
        content = path.read_text().replace("gravity_world", "").replace("inertia_ratios", "").replace("sigma_length_scale", "")
        assert [word for word in (*KNOWN, *seeds) if word in content or word in str(path.relative_to(root))] == []


def test_the_reader_takes_every_flight(root: Path) -> None:
    for case in read_field_cases(root / "made"):
        paths = trajectories_in(root / "made" / "campaigns" / case.name / "observations")
        rows = {path.stem: len(read_trajectory(path, {}).times_s) for path in paths}
        assert rows == {flight.name: flight.rows for flight in case.flights}


def test_resuming_solves_only_what_is_missing(root: Path) -> None:
    kept, lost = root / "answers" / "f001.answer.json", root / "answers" / "f002.answer.json"
    before, old = kept.stat().st_mtime_ns, json.loads(lost.read_text())
    lost.unlink()
    assert tumble("solve", root / "made", "--out", root / "answers", "--jobs", "1", "-q", "--resume") == 0
    assert kept.stat().st_mtime_ns == before
    assert {**json.loads(lost.read_text()), "cpu_s": None} == {**old, "cpu_s": None}


def test_answers_are_scored(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert tumble("score", root / "made", root / "answers", "--out", root / "scored", "--jobs", "1") == 0
    assert "campaigns with a false name" in capsys.readouterr().out
    tables = {name: (root / "scored" / f"{name}.csv").read_text() for name in TABLES}
    assert len(pd.read_csv(root / "scored" / "cases.csv")) == 3
    assert all(tables.values())
    summary = json.loads((root / "scored" / "summary.json").read_text())
    assert summary["campaigns"] == 3
    assert "# Field challenge" in (root / "scored" / "field.md").read_text()
    assert tumble("score", root / "made", root / "answers", "--out", root / "scored", "-q") == 2
    assert tumble("score", root / "made", root / "answers", "--out", root / "scored", "-q", "--force") == 0


def test_a_run_without_one_answer_says_so(root: Path, tmp_path: Path) -> None:
    for path in (root / "answers").iterdir():
        if path.name != "f003.answer.json" and path.is_file():
            (tmp_path / path.name).write_bytes(path.read_bytes())
    assert tumble("score", root / "made", tmp_path, "--out", tmp_path / "scored", "-q") == 1


def test_what_is_no_case_is_refused(root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "truth" / "f001" / "case.json"
    path.parent.mkdir(parents=True)
    path.write_text('{"measured": "poses"}')
    assert tumble("score", tmp_path, root / "answers", "--out", tmp_path / "scored", "-q") == 2
    error = capsys.readouterr().err
    assert "case.json" in error
    assert "expected" in error
    assert tumble("make", "--field", "--most-rows", "3", "--out", tmp_path / "made", "-q") == 2
    assert not (tmp_path / "made").exists()
    assert tumble("make", "--field", "--singles", "3", "--views-off", "1", "--out", tmp_path / "made", "-q") == 2
    assert not (tmp_path / "made").exists()
    assert "--singles, --views-off" in capsys.readouterr().err


@pytest.mark.parametrize("off", ["-1", "nan", "101"])
def test_views_cannot_be_off_by_less_than_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str], off: str) -> None:
    assert tumble("make", f"--views-off={off}", "--out", tmp_path / "made", "-q") == 2
    assert "expected pixels, 0 to 100" in capsys.readouterr().err
    assert not (tmp_path / "made").exists()
