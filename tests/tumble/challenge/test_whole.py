"""A small challenge from a fresh seed, through the command line: made, solved where no truth exists, scored."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest

from datasets.observation_files import read_observation
from datasets.recipes.effects import KNOWN
from tumble.challenge.cases import read_cases
from tumble.cli import main as command_line

pytestmark = pytest.mark.long

FLIGHT = ["--frames", "30", "--views", "12"]
TINY = ["--sequences", "2", *FLIGHT, "--jobs", "1", "-q"]
ALONE = ["--sequences", "1", *FLIGHT]


def tumble(*words: str | Path) -> int:
    return command_line.main(["challenge", *(str(word) for word in words)])


@pytest.fixture(scope="module")
def challenge(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three campaigns whose seed nobody knows."""
    root = tmp_path_factory.mktemp("challenge")
    counts = ["--singles", "1", "--controls", "1", "--pairs", "0", "--outside", "1"]
    assert tumble("make", "--out", root / "made", *TINY, *counts, "--smallest", "5") == 0
    return root


@pytest.fixture(scope="module")
def answers(challenge: Path) -> Path:
    """Answers found where the truth tree does not exist."""
    truth = challenge / "made" / "truth"
    hidden = challenge / "elsewhere"
    truth.rename(hidden)
    keep = ["--keep", challenge / "kept"]
    assert tumble("solve", challenge / "made", "--out", challenge / "answers", "--jobs", "1", "-q", *keep) == 0
    hidden.rename(truth)
    return challenge / "answers"


def test_observations_give_nothing_away(challenge: Path) -> None:
    seed = json.loads((challenge / "made" / "truth" / "run.json").read_text())["seed"]
    seeds = [str(seed), *(str(case.recipe.seed) for case in read_cases(challenge / "made"))]
    files = [path for path in (challenge / "made" / "campaigns").rglob("*") if path.is_file()]
    assert len(files) == 3 * 2 * 3
    for path in files:
        content = path.read_bytes()
        told = [word for word in (*KNOWN, *seeds, "cut_stone", "jagged") if word.encode() in content.replace(b"gravity_world", b"")]
        assert told == []


def test_a_campaign_has_the_shape_asked_for(challenge: Path) -> None:
    observation = read_observation(challenge / "made" / "campaigns" / "c001" / "observations" / "c001-2")
    assert (observation.name, observation.mass_kg) == ("c001-2", None)
    assert (len(observation.views), len(observation.clock.times_s)) == (12, 30)


def test_another_seed_is_drawn_each_time(challenge: Path, tmp_path: Path) -> None:
    assert tumble("make", "--out", tmp_path, *TINY, "--singles", "0", "--controls", "1", "--pairs", "0", "--outside", "0") == 0
    first, second = (json.loads((root / "truth" / "run.json").read_text())["seed"] for root in (challenge / "made", tmp_path))
    assert first != second


def test_every_campaign_has_one_answer(answers: Path) -> None:
    for name in ("c001", "c002", "c003"):
        said = json.loads((answers / f"{name}.answer.json").read_text())
        assert said["campaign"] == name
        assert {row["effect"] for row in said["parameters"]} == set(said["found"])


def test_resuming_solves_only_what_is_missing(challenge: Path, answers: Path) -> None:
    names = {case.kind: case.name for case in read_cases(challenge / "made")}
    kept, lost = answers / f"{names['outside']}.answer.json", answers / f"{names['control']}.answer.json"
    before, old = kept.stat().st_mtime_ns, json.loads(lost.read_text())
    lost.unlink()
    assert tumble("solve", challenge / "made", "--out", answers, "--jobs", "1", "-q", "--resume") == 0
    assert kept.stat().st_mtime_ns == before
    new = json.loads(lost.read_text())
    assert {**new, "cpu_s": None} == {**old, "cpu_s": None}


def test_scores_cover_every_case_and_print_every_line(challenge: Path, answers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = challenge / "score"
    kept = ["--keep", challenge / "kept", "--result", challenge / "result.json"]
    assert tumble("score", challenge / "made", answers, "--out", out, "--jobs", "1", *kept) == 0
    printed = capsys.readouterr().out.splitlines()
    assert all("n = " in line and "asked: " in line for line in printed)
    assert {line[0] for line in printed} == {"1", "2", "3", "4", "5", "7"}
    cases = pd.read_csv(out / "cases.csv")
    assert sorted(cases["kind"]) == ["control", "outside", "single"]
    single = cases[cases["kind"] == "single"].iloc[0]
    # The seed is fresh and 30 frames are few: an error of any size may come, or none where nothing could be registered.
    assert not any(single[name] <= 0.0 for name in ("base_px", "final_px", "oracle_px"))
    result = json.loads((challenge / "result.json").read_text())
    assert result["counts"] == {"control": 1, "outside": 1, "single": 1}


def test_a_gap_in_the_recording_is_found(tmp_path: Path) -> None:
    counts = ["--singles", "1", "--controls", "0", "--pairs", "0", "--outside", "0", "--effects", "dropped_frames", "--seed", "7"]
    assert tumble("make", "--out", tmp_path / "made", *ALONE, *counts, "--jobs", "1", "-q") == 0
    assert tumble("solve", tmp_path / "made", "--out", tmp_path / "answers", "--jobs", "1", "-q") == 0
    said = json.loads((tmp_path / "answers" / "c001.answer.json").read_text())
    assert "dropped_frames" in said["found"]
    shutil.rmtree(tmp_path / "made" / "truth")
    assert tumble("score", tmp_path / "made", tmp_path / "answers", "--out", tmp_path / "score") == 2


def test_what_was_hidden_is_told_at_last(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shape = ["--sequences", "2", *FLIGHT, "--seed", "2"]  # one alone is blind to half of the effects, give or take what rounding does
    assert tumble("hidden", "--out", tmp_path / "hidden", *shape) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert told.index("Which effect is missing?") < told.index("held-out") < told.rindex("hidden was") > told.index("And the truth:")
    assert (tmp_path / "hidden" / "explain" / "report.html").is_file()
    notes = tmp_path / "hidden" / "compare" / "notes.txt"
    notes.write_text("mine")
    assert tumble("hidden", "--out", tmp_path / "hidden", *shape) == 2
    assert "got ../compare/notes.txt, which it did not write" in capsys.readouterr().err
    assert notes.is_file()


def test_what_is_no_challenge_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert tumble("solve", tmp_path / "nothing", "--out", tmp_path / "a") == 2
    assert "expected campaigns" in capsys.readouterr().err
    assert tumble("make", "--out", tmp_path / "m", "--effects", "gravty") == 2
    assert "--effects gravty: expected effects with a detection limit" in capsys.readouterr().err
