"""Starts along a track: the spin over wide windows, another reference time, and a track that is loose where it begins."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.data.fit_task import FitTask, restricted
from estimator.fitting.trajectory import fit_growing
from estimator.motion.flight import N_PARAMETERS, Flight, poses, velocities
from estimator.motion.rotation import rotation_from_vector
from estimator.search.flight_starts import SPIN_WINDOWS, at_time, best_start, flight_of_track, starts_along
from estimator.search.tracking import Track
from tests.estimator.fitting.test_within_sequence import seen_by_two, spinning

Array = NDArray[np.float64]
STILL = np.zeros((1, N_PARAMETERS))
MIDDLE_S = 0.0125


def track_of(flight: Flight, times_s: Array, loose_rad: Array) -> Track:
    """The poses of a flight, each turned by a random angle of standard deviation ``loose_rad`` (n,) about a line across the camera's."""
    flown = poses(flight, STILL, times_s)
    turn = np.random.default_rng(8).normal(size=len(times_s)) * loose_rad
    R = rotation_from_vector(turn[:, None] * np.array([0.6, 0.8, 0.0])) @ flown.R[:, 0]
    return Track(times_s=times_s, R=R, centre=flown.centre[:, 0], cost=np.ones(len(times_s)))


def spin_errors(starts: list[Flight], truth: Flight) -> Array:
    return np.array([np.linalg.norm(s.omega - velocities(truth, STILL, s.time_s)[1][0]) for s in starts])


def test_an_exact_track_gives_the_spin_at_every_time_and_window() -> None:
    """About a principal axis the spin is steady; half the widest window is more than half a revolution here."""
    still = replace(spinning(), time_s=MIDDLE_S)
    axis = Rotation.from_quat(still.q).as_matrix()[:, 2]
    fast = replace(still, omega=900.0 * axis)
    starts = starts_along(track_of(fast, np.arange(100) / 4000.0, np.zeros(100)), fast.body, fast.gravity_world)
    assert len({s.time_s for s in starts}) * len(SPIN_WINDOWS) == len(starts)
    assert spin_errors(starts, fast).max() < 0.1


def test_where_a_track_is_loose_wide_windows_and_other_times_do_better() -> None:
    flight = replace(spinning(), time_s=MIDDLE_S)
    times = np.arange(100) / 4000.0
    track = track_of(flight, times, np.where(np.abs(times - MIDDLE_S) < 0.006, 0.03, 0.002))
    first = flight_of_track(track, flight.body, flight.gravity_world, time_s=float(times[50]))
    starts = starts_along(track, flight.body, flight.gravity_world)
    here = [s for s in starts if s.time_s == pytest.approx(times[50], abs=1e-3)]
    errors = spin_errors(here, flight)
    assert spin_errors([first], flight)[0] > 20.0
    assert errors[2] < 0.5 * errors[0]
    assert spin_errors(starts, flight).min() < 5.0


def test_another_reference_time_is_the_same_flight() -> None:
    times = np.linspace(0.0, 0.02, 9)
    flight = replace(spinning(), com=np.array([2e-5, -1e-5, 3e-5]), inertia=np.array([0.01, -0.02, 0.002, -0.001, 0.003]))
    moved = at_time(flight, 0.017)
    assert moved.time_s == 0.017
    for a, b in zip(poses(flight, STILL, times).__dict__.values(), poses(moved, STILL, times).__dict__.values(), strict=True):
        np.testing.assert_allclose(a, b, atol=3e-7)


def test_the_best_start_of_a_loose_track_leads_to_the_flight(exact: FitTask) -> None:
    """A camera's track loose by several degrees near the reference; the fit from the best start comes out at the truth."""
    times = exact.sightings.times_s
    track = track_of(spinning(), times, np.where(np.abs(times - 0.004) < 0.002, 0.1, 0.005))
    starts = starts_along(track, spinning().body, spinning().gravity_world)
    best = best_start(exact, starts)
    assert np.linalg.norm(spin_errors([best], spinning())) < 0.5 * spin_errors(starts, spinning()).max()
    found = at_time(fit_growing(exact, best).state, spinning().time_s)
    np.testing.assert_allclose(found.omega, spinning().omega, atol=0.1)
    np.testing.assert_allclose(found.v, spinning().v, atol=2e-3)


@pytest.fixture(scope="module")
def exact() -> FitTask:
    """What one camera sees of the spinning ellipsoid, exactly."""
    both = seen_by_two(spinning())
    return restricted(both, np.flatnonzero(both.sightings.camera == 0))
