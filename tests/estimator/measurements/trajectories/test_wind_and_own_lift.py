"""Wind acts through what flights share: it never carries a lift that every flight has of its own into sets that do not have it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.trajectory import Trajectory
from datasets.trajectory_files import LEAST_ROWS, read_trajectory, trajectories_in
from datasets.vocabulary.effects import Stage
from estimator.diagnosis.explain import explain
from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.measurements.trajectories.task import trajectory_errors
from scripts.real_campaigns import tosses
from tests.estimator.made_trajectories import Hidden, Tracker, campaign

pytestmark = pytest.mark.long

TRIED = ("frame_rate", "unmeasured_lift", "uniform_acceleration", "linear_drag", "steady_wind")


def test_wind_does_nothing_to_a_lift_of_every_flights_own() -> None:
    registered = register_trajectories(campaign(1, Hidden(), Tracker(orientation=False)))
    model = Model((MODELS["unmeasured_lift"], MODELS["steady_wind"]))
    still, windy = (
        trajectory_errors(registered.campaign.sequences[0], registered.start.flights[0], model, np.array([0.1, -0.2, 0.3, *wind]))
        for wind in (np.zeros(3), np.array([2.0, -1.0, 3.0]))
    )
    np.testing.assert_array_equal(windy.e, still.e)
    assert not windy.J[..., -3:].any()


def positions_alone(trajectory: Trajectory, step: int) -> Trajectory:
    """Every so many rows of it, without orientations."""
    times, x = trajectory.times_s[::step], trajectory.x_world[::step]
    return replace(trajectory, times_s=times, x_world=x, q_world_tracked=None, sigma_theta=None)


@pytest.mark.parametrize("step", [1, 3])
def test_real_tosses_by_their_positions_alone_are_not_called_lift(step: int, tmp_path: Path, shared_data: Path) -> None:
    """All rows ended with a lift of every toss, a wind and a drag, and nothing more missing; a third with a lift beside what is unknown."""
    tosses(shared_data, tmp_path)
    every = [positions_alone(read_trajectory(path, {}), step) for path in trajectories_in(tmp_path)]
    registered = register_trajectories([each for each in every if len(each.times_s) >= LEAST_ROWS])
    found = explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})
    assert set(found.found) == {"frame_rate", "uniform_acceleration"}
    assert found.left is not None
    assert found.left.present
    assert found.left.stage is Stage.TRACKING
