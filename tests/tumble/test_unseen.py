"""What v and omega take for granted: what no test shows and yet moves them, by how much, and what is left of it once it is stated."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.estimate_files import read_estimate
from datasets.json_documents import read_document
from datasets.trajectory import Trajectory
from estimator.effects.choosing import catalogue
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tests.tumble.test_trajectory_verbs import write_csv
from tumble.cli.main import main
from tumble.unseen import Unseen, unseen_entry, unseen_sentence

GRAVITY = "--gravity=0,0,-9.81"
SCALE = 0.05
"""End of the plausible range of lengths; these few rows would show 10%."""


def few_rows() -> Trajectory:
    (made,) = campaign(5, Hidden(), Tracker(rows=12), sequences=1)
    return made


def larger(made: Trajectory, by: float) -> Trajectory:
    """As recorded with a ruler that is so much too short."""
    assert made.x_world is not None
    return replace(made, x_world=made.x_world * (1.0 + by))


def written(folder: Path, made: Trajectory) -> None:
    (folder / "recording").mkdir(parents=True)
    write_csv(made, folder / "recording")


def limits(folder: Path, made: Trajectory, *options: str) -> dict[str, Any]:
    """What limits velocities, by ``diagnose`` of one recording."""
    written(folder, made)
    assert main(["diagnose", str(folder / "recording"), GRAVITY, *options, "--out", str(folder / "out"), "-q"]) == 0
    return dict(read_document(folder / "out" / "diagnosis.json", "diagnosis")["limits"])


def velocity(folder: Path, made: Trajectory) -> np.ndarray:
    written(folder, made)
    assert main(["estimate", str(folder / "recording"), GRAVITY, "--out", str(folder / "out"), "-q"]) == 0
    middle = read_estimate(next((folder / "out").glob("*.estimate.json"))).middle
    assert middle is not None
    return middle.v_world


def of(things: list[dict[str, Any]], name: str) -> dict[str, Any]:
    return next(thing for thing in things if thing["name"] == name)


def test_velocities_are_off_by_what_is_told(tmp_path: Path) -> None:
    """The same rows with lengths at the end of what is plausible, which no test shows."""
    made = few_rows()
    told = limits(tmp_path / "told", made)
    scale = of(told["unseen"]["things"], "length_scale")
    assert scale["size"] == "length scale of 4.9%"
    moved = velocity(tmp_path / "off", larger(made, 0.049)) - velocity(tmp_path / "right", made)
    assert scale["v_ms"] == pytest.approx(np.linalg.norm(moved), rel=0.1)
    assert scale["v_ms"] > 5.0 * told["total"]["v_ms"]
    assert "with length scale of 4.9%" in told["unseen"]["sentence"]


def test_what_is_stated_as_possible_is_in_the_error_bars_and_not_taken_for_granted(tmp_path: Path) -> None:
    made = few_rows()
    bare, stated = limits(tmp_path / "bare", made), limits(tmp_path / "stated", made, "--possible", "length_scale=±5%")
    assert "length_scale" not in [thing["name"] for thing in stated["unseen"]["things"]]
    expected = np.hypot(bare["total"]["v_ms"], of(bare["unseen"]["things"], "length_scale")["v_ms"])
    assert stated["total"]["v_ms"] == pytest.approx(expected, rel=0.02)


@pytest.fixture
def found() -> tuple[Unseen, Unseen]:
    by_key = catalogue()
    return Unseen(by_key["centre_of_mass"], (0.02, 0.05, 0.01), 0.11, 1e-9), Unseen(by_key["frame_rate"], (0.05,), 0.06, 0.08)


def test_what_matters_is_told_with_its_size_and_what_to_do(found: tuple[Unseen, Unseen]) -> None:
    sentence = unseen_sentence(found, (0.001, 0.01))
    assert "v would be off by 0.11 m/s with centre of mass of 0.05 m, 0.06 m/s with frame rate of 5%" in sentence
    assert "ω would be off by 0.08 rad/s with frame rate of 5%" in sentence
    assert "--possible EFFECT=±SIGMA" in sentence
    assert "frame_rate=0±1e-5" in sentence


def test_nothing_is_told_where_it_is_within_the_error_bars_or_not_measured(found: tuple[Unseen, Unseen]) -> None:
    assert unseen_sentence(found, (0.2, 0.1)) == ""
    spin_alone = [replace(each, v_ms=float("nan")) for each in found]
    assert unseen_sentence(spin_alone, (float("nan"), 0.1)) == ""
    entry = unseen_entry(spin_alone, {"v_ms": float("nan"), "omega_rads": 0.01})
    assert [thing["name"] for thing in entry["things"]] == ["frame_rate", "centre_of_mass"]
    assert entry["sentence"].startswith("That takes for granted what these data would not show: ω would be off")
