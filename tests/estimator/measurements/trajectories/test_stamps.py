"""Even frames whose stamps are rounded or late: the stamps are told, and no force, noise or distortion stands for them."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.trajectory import Trajectory
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.catalogue.clock.stamp_scatter import to_even_times
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.motion.flight import N_PARAMETERS
from tests.estimator.made_trajectories import GRAVITY, RATE_HZ, Hidden, Tracker, campaign

TRIED = ("stamp_scatter", "trigger_jitter", "position_distortion", "quadratic_drag", "uniform_acceleration", "frame_rate")
NUMBER, DRAG, LATE_S, ROUNDED_S = 10, 0.3, 6e-4, 1e-3
TRACKER = Tracker(rows=36, sigma_x=7e-4, orientation=False)
LOST = (7, 20)
"""Frames that are lost of each flight."""


def moved(trajectory: Trajectory, *, late: bool) -> Trajectory:
    """Stamps rounded to a millisecond; where asked for, late ones on one side of the volume."""
    rows = np.delete(np.arange(TRACKER.rows), LOST)
    busy = LATE_S * (trajectory.x_world[rows, 0] > 0.0) if late else 0.0
    stamps = np.round((trajectory.times_s[rows] + busy) / ROUNDED_S) * ROUNDED_S
    return replace(trajectory, times_s=stamps, x_world=trajectory.x_world[rows])


def explained(made: list[Trajectory]) -> Explanation:
    registered = register_trajectories(made)
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})


def value_of(found: Explanation, key: str) -> tuple[float, float]:
    """An effect's first parameter with its standard deviation."""
    place = found.fit.model.slices[found.fit.model.keys.index(key)].start
    variance = found.covariance.of(0, np.array([N_PARAMETERS + place]))[0, 0]
    return float(found.fit.state.theta[0][place]), float(np.sqrt(variance))


@pytest.mark.parametrize("late", [True, False])
def test_stamps_that_are_rounded_or_late_in_one_place_are_what_is_told(late: bool) -> None:
    made = campaign(3 + late, Hidden(drag=DRAG), TRACKER, sequences=NUMBER)
    found = explained([moved(each, late=late) for each in made])
    assert set(found.found) == {"quadratic_drag", "stamp_scatter"}
    assert all(step.established for step in found.steps)
    for key, true in (("stamp_scatter", 1.0), ("quadratic_drag", DRAG)):
        value, sigma = value_of(found, key)
        assert abs(value - true) < 3.0 * sigma < 0.3 * true
    assert not found.left.present


def test_frames_that_were_uneven_are_not_made_even() -> None:
    """Falling points at uneven times, whose stamps are right."""
    rng = np.random.default_rng(2)
    made = []
    for each in campaign(2, Hidden(), TRACKER, sequences=NUMBER):
        times = each.times_s + rng.normal(0.0, LATE_S, TRACKER.rows)
        x = rng.uniform(-2.0, 2.0, 3) * times[:, None] + 0.5 * GRAVITY * times[:, None] ** 2
        made.append(replace(each, times_s=times, x_world=x + rng.normal(0.0, TRACKER.sigma_x, x.shape)))
    assert explained(made).found == ()


def test_even_times_number_frames_beside_lost_ones_and_late_stamps() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        numbers = np.sort(rng.choice(66, 60, replace=False))
        stamps = np.round(numbers / RATE_HZ, 3)
        stamps[rng.choice(60, 4, replace=False)] += 2e-3
        short = np.round(np.arange(9) / RATE_HZ + rng.uniform(0.0, 1e-3), 3)
        for t, k, off in zip((stamps, short), (numbers, np.arange(9)), to_even_times([stamps, short]), strict=True):
            even = (t + off) * RATE_HZ
            assert np.abs(even - even[0] - (k - k[0])).max() < 0.1


def test_even_stamps_are_left_as_they_are_and_few_ones_say_nothing() -> None:
    every = to_even_times([np.arange(300) / 4000.0, np.array([0.1, 0.2]), np.array([0.3])])
    assert not any(off.any() for off in every)
    assert to_even_times([np.array([0.0, 1.0])])[0].tolist() == [0.0, 0.0]
