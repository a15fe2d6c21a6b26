"""Flights with impacts: no jump is no impact, momentum is what jumps, and derivatives are those of the poses."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.motion.flight import (
    N_PARAMETERS,
    STEPS,
    FlightPoses,
    flown,
    pose_differences,
    poses_and_sensitivity,
    rates,
    still,
    velocities,
    velocity_sensitivity,
)
from estimator.motion.piecewise import Bounce, PiecewiseFlight, touch_and_sensitivity
from tests.estimator.fitting.test_within_sequence import spinning

Array = NDArray[np.float64]
TIMES = np.linspace(0.0, 0.012, 13)
IMPACTS_S = (0.0053, 0.0081)


def bouncing() -> PiecewiseFlight:
    """Two impacts after the flight of the other tests."""
    after = (Bounce(IMPACTS_S[0], np.array([0.9, -1.1, 0.2]), np.array([-250.0, 90.0, 310.0])), Bounce(IMPACTS_S[1], *np.eye(3)[:2] * 40.0))
    body = replace(spinning().body, inertia_ratios=np.array([0.5, 0.8, 1.0]))
    return PiecewiseFlight(replace(spinning(), body=body), after)


def without_jump() -> PiecewiseFlight:
    flight = bouncing().first
    v, omega = velocities(flight, np.zeros((1, N_PARAMETERS)), IMPACTS_S[0])
    return PiecewiseFlight(flight, (Bounce(IMPACTS_S[0], v[0], omega[0]),))


def test_an_impact_without_a_jump_is_none() -> None:
    flight = without_jump()
    one, both = flown(flight.first, TIMES), flown(flight, TIMES)
    np.testing.assert_allclose(both.centre, one.centre, atol=1e-9)
    np.testing.assert_allclose(both.R, one.R, atol=1e-6)


def test_the_time_of_an_impact_without_a_jump_does_not_matter_but_for_what_follows_from_gravity() -> None:
    flight = without_jump()
    _, S = poses_and_sensitivity(flight, TIMES)
    later = TIMES > IMPACTS_S[0]
    by_time = S[:, :, flight.layout["impact_1_time"]][..., 0]
    gone = TIMES[later] - IMPACTS_S[0]
    np.testing.assert_allclose(by_time[~later], 0.0, atol=1e-9)
    np.testing.assert_allclose(by_time[later][:, :3], -np.outer(gone, flight.first.gravity_world), atol=1e-6)


def test_pose_goes_on_and_velocities_jump() -> None:
    flight = bouncing()
    beside = np.array([IMPACTS_S[0] - 1e-9, IMPACTS_S[0] + 1e-9])
    at, both = flown(flight, beside), rates(flight, still(flight), beside)[:, 0]
    np.testing.assert_allclose(at.centre[0], at.centre[1], atol=1e-8)
    np.testing.assert_allclose(at.R[0], at.R[1], atol=1e-6)
    np.testing.assert_allclose(both[1], np.r_[flight.bounces[0].v, flight.bounces[0].omega], atol=1e-4)
    assert np.linalg.norm(both[1] - both[0]) > 100.0


@pytest.mark.parametrize("column", range(N_PARAMETERS + 14))
def test_derivatives_are_those_of_flights_moved_by_a_step(column: int) -> None:
    """Whole flights with other parameters, among them other times of impact, against the sensitivity."""
    flight = bouncing()
    widths = np.concatenate([np.where(STEPS > 0.0, STEPS, 1.0), *[np.array([2e-6, *[1e-4] * 3, *[1e-2] * 3])] * 2])
    step = np.zeros(flight.size)
    step[column] = widths[column]
    flights = (flight, flight.moved(step), flight.moved(-step))
    every = [flown(f, TIMES) for f in flights]
    stacked = FlightPoses(np.concatenate([e.centre for e in every], axis=1), np.concatenate([e.R for e in every], axis=1))
    expected = pose_differences(stacked, np.array([2.0 * widths[column]]))[:, :, 0]
    found = poses_and_sensitivity(flight, TIMES)[1][:, :, column]
    np.testing.assert_allclose(found, expected, atol=2e-5 * max(1.0, float(np.abs(expected).max())))


def test_what_is_told_of_an_impact_moves_with_its_parameters() -> None:
    flight = bouncing()
    touch, J = touch_and_sensitivity(flight, 1)
    step = np.zeros(flight.size)
    for name, change in (("1_time", 2e-6), ("2_time", -1e-6), ("2_v", [0.01, -0.02, 0.03]), ("2_omega", [1.0, 2.0, -1.0])):
        step[flight.layout[f"impact_{name}"]] = change
    moved, _ = touch_and_sensitivity(flight.moved(step), 1)
    np.testing.assert_allclose(moved.x[0] - touch.x[0], J[:3] @ step, atol=1e-9)
    np.testing.assert_allclose(moved.before[0] - touch.before[0], J[6:12] @ step, atol=1e-3)
    np.testing.assert_allclose(moved.after[0] - touch.after[0], J[12:18] @ step, atol=1e-9)


def test_velocities_after_an_impact_do_not_depend_on_those_before() -> None:
    flight = bouncing()
    J = velocity_sensitivity(flight, 0.0055)
    assert np.abs(J[:3, flight.layout["v"]]).max() < 1e-6
    np.testing.assert_allclose(J[:3, flight.layout["impact_1_v"]], np.eye(3), atol=1e-6)
    assert flight.layout.labels[-7:] == tuple(f"impact_2_{each}" for each in ("time_s", *flight.layout.labels[6:12]))
