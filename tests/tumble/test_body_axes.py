"""Axes of a body are counted by their moments: whoever states them along a telephone's axes is told which is which."""

from pathlib import Path

from datasets.trajectory import Trajectory
from datasets.trajectory_files import read_trajectory
from tumble.tracked_bodies import axes_words

RACKET, ALREADY, BALL = [0.91, 0.11, 1.0], [0.11, 0.91, 1.0], [1.0, 1.0, 1.0]


def throw(folder: Path, ratios: list[float]) -> dict[str, Trajectory]:
    path = folder / "throw.csv"
    path.write_text("t_s,gyro_x_rads,gyro_y_rads,gyro_z_rads\n" + "".join(f"{0.01 * i},{i % 3},{i % 2},{i % 5}\n" for i in range(8)))
    return {"throw": read_trajectory(path, {"inertia_ratios": ratios})}


def test_axes_that_were_stated_in_another_order_are_told(tmp_path: Path) -> None:
    (told,) = axes_words(throw(tmp_path, RACKET), ["spin_damping", "inertia_ratios"])
    assert told == "Axes of the body are counted by their moments, the smallest first: of the tracked frame, 1 is y, 2 is x, 3 is -z."


def test_nothing_is_told_where_it_says_nothing(tmp_path: Path) -> None:
    assert not [*axes_words(throw(tmp_path, RACKET), ["spin_damping"])]
    assert not [*axes_words(throw(tmp_path, ALREADY), ["inertia_ratios"])]
    assert not [*axes_words(throw(tmp_path, BALL), ["inertia_ratios"])]
