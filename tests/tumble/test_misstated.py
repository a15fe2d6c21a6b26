"""Gravity, lengths and times that are stated wrongly are told first; what air does is not taken for that."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.json_documents import read_document
from datasets.trajectory import Trajectory
from estimator.data.configuration import configuration_from_dict
from tests.estimator.made_trajectories import GRAVITY, Hidden, Tracker, campaign
from tests.tumble.test_trajectory_verbs import write_csv
from tumble.campaigning import prepare
from tumble.cli.main import main
from tumble.implausible import ball_words
from tumble.misstated import misstated

Array = NDArray[np.float64]


def _said(trajectories: list[Trajectory]) -> str:
    wrong = misstated({t.name: t for t in trajectories}, Path("tosses"), {})
    return "" if wrong is None else f"{wrong.sentence} next: {wrong.mend}"


def _tosses(*, stated: Array = GRAVITY, lengths: float = 1.0, times: float = 1.0) -> list[Trajectory]:
    made = campaign(8, Hidden(drag=0.1), Tracker(rows=20, orientation=False), sequences=4)
    return [
        replace(t, x_world=lengths * t.x_world, times_s=times * t.times_s, surroundings=replace(t.surroundings, gravity_world=stated))
        for t in made
    ]


@pytest.mark.parametrize(
    ("tosses", "told"),
    [
        (_tosses(lengths=100.0), "centimetres called metres"),
        (_tosses(lengths=1.0 / 0.0254), "inches called metres"),
        (_tosses(lengths=1e-3), "metres called millimetres"),
        (_tosses(times=148.0), " times too long (frames called seconds?)"),
        (_tosses(stated=-GRAVITY), "the sign of gravity_world, or that of the vertical axis."),
        (_tosses(stated=np.array([0.0, -9.81, 0.0])), "accelerate along -z by 9."),
        (_tosses(stated=np.array([0.0, -9.81, 0.0]), lengths=100.0), "the axis of gravity_world; and units: lengths that are"),
    ],
)
def test_what_is_stated_wrongly_is_told(tosses: list[Trajectory], told: str) -> None:
    said = _said(tosses)
    assert told in said
    assert "Check first what was stated: " in said
    assert "gravity_world in tosses/trajectory.toml" in said or "gravity_world in trajectory.toml" in said


def test_tosses_stated_rightly_are_not_judged() -> None:
    assert not _said(_tosses())


def _film(t: Trajectory, gravity: Array) -> Trajectory:
    """The same without z, which was not measured."""
    x = t.x_world.copy()
    x[:, 2] = np.nan
    return replace(t, x_world=x, surroundings=replace(t.surroundings, gravity_world=gravity))


def test_a_film_from_the_side_is_judged_by_the_axes_it_shows() -> None:
    turned = [replace(t, x_world=t.x_world[:, [0, 2, 1]]) for t in _tosses()]
    assert not _said([_film(t, np.array([0.0, -9.81, 0.0])) for t in turned])
    assert "accelerate along -y by 9." in _said([_film(t, GRAVITY) for t in turned])


def _flown(pull: Callable[[Array], Array], start: Array, name: str, rows: int = 60) -> Trajectory:
    """A flight of 0.4 s under ``pull`` (m/s², of the velocity), by small steps, with noise of 0.5 mm."""
    steps, dt = 100, 0.4 / (rows - 1) / 100
    x, v, path = np.zeros(3), start, []
    for _ in range(rows):
        path.append(x)
        for _ in range(steps):
            v = v + dt * pull(v)
            x = x + dt * v
    made = campaign(1, Hidden(), Tracker(rows=rows, orientation=False), sequences=1)[0]
    noise = np.random.default_rng(len(name)).normal(0.0, 5e-4, (rows, 3))
    return replace(made, name=name, times_s=steps * dt * np.arange(rows), x_world=np.array(path) + noise)


def _air(v: Array) -> Array:
    """Drag and topspin or backspin of a table tennis ball."""
    return np.asarray(GRAVITY - 0.12 * np.linalg.norm(v) * v + np.cross([0.0, -1.2, 0.0], v))


@pytest.mark.parametrize(
    ("pull", "speed"),
    [
        (_air, np.array([10.0, 0.0, 2.0])),  # lift as strong as gravity
        (lambda v: GRAVITY - 8.0 * v, np.array([0.0, 0.0, -9.81 / 8.0])),  # a feather that sinks steadily
        (lambda v: GRAVITY - 6.0 * (v - [0.0, 0.0, 9.81 / 6.0]), np.array([0.1, 0.0, 0.0])),  # a ball that floats in a wind
        (lambda v: GRAVITY - 2.0 * v, np.array([5.0, 0.0, 5.0])),  # a beach ball
    ],
)
def test_air_is_not_taken_for_a_statement_that_is_wrong(pull: Callable[[Array], Array], speed: Array) -> None:
    assert not _said([_flown(pull, speed + 0.1 * i, f"flight_{i}" + "_" * i) for i in range(4)])


def _written(folder: Path, made: list[Trajectory]) -> Path:
    folder.mkdir()
    for each in made:
        write_csv(each, folder)
    return folder


@pytest.mark.parametrize("verb", ["compare", "diagnose", "explain"])
def test_verbs_tell_it_first_and_tell_no_story(tmp_path: Path, verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    tosses = _written(tmp_path / "tosses", campaign(8, Hidden(), Tracker(rows=20), sequences=5))
    assert main([verb, str(tosses), "--gravity=0,0,9.81", "--out", str(tmp_path / "out")]) in (0, 1)
    verdict = (found := read_document(tmp_path / "out" / "diagnosis.json", "diagnosis"))["verdict"]
    assert verdict["sentence"].startswith("Positions fall with -")
    assert verdict["sentence"].endswith("Check first what was stated: the sign of gravity_world, or that of the vertical axis.")
    assert verdict["next"] == "mend gravity_world in the command line (--gravity), then run the same command again with --force"
    assert (found["unknown"], verdict["add"]) == (None, [])
    said = capsys.readouterr().out.splitlines()
    assert said[0] == verdict["sentence"]
    assert "v is known to" not in "".join(said)


def test_a_ball_whose_moments_are_stated_is_not_asked_for_them() -> None:
    made = campaign(8, Hidden(), Tracker(rows=20), sequences=1)
    assert list(ball_words({"toss": made[0]}, stated=False))
    assert not list(ball_words({"toss": made[0]}, stated=True))


@pytest.mark.parametrize("said", [True, False])
def test_moments_of_inertia_are_known_to_be_stated(tmp_path: Path, *, said: bool) -> None:
    tosses = _written(tmp_path / "tosses", campaign(8, Hidden(), Tracker(rows=20), sequences=2))
    text = "gravity_world = [0.0, 0.0, -9.81]\n" + "inertia_ratios = [1.0, 1.0, 1.0]\n" * said
    (tosses / "trajectory.toml").write_text(text, encoding="utf-8")
    assert prepare(tosses, configuration_from_dict({}), (), quiet=True).shape_stated == said
