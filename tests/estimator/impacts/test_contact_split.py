"""Impacts that were two contacts, on exact outlines: told from single ones, loosened where nothing was seen between, split where it was."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.fitting.trajectory import fit
from estimator.fitting.weighed_tangencies import Refinement
from estimator.impacts.contact_split import parted
from estimator.impacts.impact_contacts import separated_contacts
from estimator.impacts.loose_contact import loosened, spread_needed, spread_of
from estimator.impacts.piecewise_fit import refine_piecewise, spread_at
from estimator.motion.flight import FlightPoses, flown, pose_differences, poses_and_sensitivity
from estimator.motion.piecewise import Bounce, PiecewiseFlight, touch_and_sensitivity
from tests.estimator.impacts.test_piecewise_fit import IMPACT_S, TIMES, bouncing, seen

Array = NDArray[np.float64]
SETTINGS = Refinement(floor_px=0.04, body_noise_px=0.05, within_pairs=0)
FRAME_S = float(TIMES[1] - TIMES[0])


def twice(apart_s: float) -> PiecewiseFlight:
    """Two contacts at which the velocities change by about half of the whole each."""
    flight = bouncing()
    (last,) = flight.bounces
    first = Bounce(IMPACT_S - 0.3 * apart_s, np.array([0.9, -0.2, 0.1]), np.array([60.0, -190.0, 40.0]))
    return replace(flight, bounces=(first, replace(last, time_s=first.time_s + apart_s)))


def as_one(flight: PiecewiseFlight) -> PiecewiseFlight:
    return replace(flight, bounces=(flight.bounces[-1],))


def chi_square(z: Array, covariance: Array) -> float:
    return float(z @ np.linalg.solve(covariance, z))


def test_a_shift_moves_what_comes_after_and_nothing_along_the_jump() -> None:
    flight = bouncing()
    loose = loosened(flight, 0, 1e-4)
    (bounce,), shift = loose.bounces, loose.layout["impact_1_shift"]
    assert bounce.loose is not None
    touch, _ = touch_and_sensitivity(flight, 0)
    jump = touch.after[0] - touch.before[0]
    sizes = np.repeat([np.linalg.norm(jump[:3]), np.linalg.norm(jump[3:])], 3)
    np.testing.assert_allclose((bounce.loose.basis / sizes[:, None]).T @ (jump / sizes), 0.0, atol=1e-12)
    _, S = poses_and_sensitivity(loose, TIMES)
    assert S.shape == (len(TIMES), 6, flight.size + 5)
    np.testing.assert_allclose(S[TIMES < IMPACT_S][:, :, shift], 0.0, atol=1e-9)
    step = np.zeros(loose.size)
    step[shift.start + 2] = 2e-6
    moved = [loose.moved(s * step) for s in (1.0, -1.0)]
    np.testing.assert_allclose(spread_of(moved[0], 0), step[shift], atol=1e-15)
    every = [flown(f, TIMES) for f in (flight, *moved)]
    stacked = FlightPoses(np.concatenate([e.centre for e in every], axis=1), np.concatenate([e.R for e in every], axis=1))
    expected = pose_differences(stacked, np.array([4e-6]))[:, :, 0]
    np.testing.assert_allclose(S[:, :, shift.start + 2], expected, atol=1e-4 * np.abs(expected).max())


def test_a_spread_is_asked_for_only_beyond_the_noise() -> None:
    covariance = np.diag([1.0, 4.0, 1.0, 1.0, 1.0]) * 1e-12
    assert spread_needed(1e-6 * np.array([1.0, -1.0, 0.5, 0.5, 1.0]), covariance) == 0.0
    z = 1e-5 * np.array([3.0, -4.0, 2.0, 0.0, 1.0])
    assert spread_needed(z, covariance) == pytest.approx(np.sqrt(np.mean(z**2)), rel=0.05)


@pytest.mark.parametrize("apart", [0.0, 0.25])
def test_two_contacts_without_a_picture_between_are_told_from_one(apart: float) -> None:
    """A quarter of a frame apart; loosened, the spin after them is right, and held to one pose it is not."""
    truth = twice(apart * FRAME_S) if apart else bouncing()
    task = replace(seen(truth), huber=4.0)
    one = refine_piecewise(task, fit(task, as_one(truth)).state, SETTINGS)
    told = separated_contacts(task, one, lambda _: task, SETTINGS, frame_s=FRAME_S)
    z, covariance = spread_at(task, one.flight, 0, SETTINGS)
    assert told.spreads[0].chi_square == pytest.approx(max(chi_square(z, covariance), 0.0))
    assert (told.spreads[0].clear, len(told.loose)) == (bool(apart), int(bool(apart)))
    if apart:
        assert 0.02 * FRAME_S < told.spreads[0].spread_s < 0.5 * FRAME_S
        true = truth.bounces[-1].omega
        held, loose = (np.linalg.norm(r.flight.bounces[0].omega - true) for r in (one, told.refined))
        assert loose < 0.3 * held
        assert loose < 0.004 * np.linalg.norm(true)


def test_two_contacts_with_a_picture_between_are_measured_one_by_one() -> None:
    truth = twice(1.3 * FRAME_S)
    task = replace(seen(truth), huber=4.0)
    one = refine_piecewise(task, fit(task, as_one(truth)).state, SETTINGS)
    told = separated_contacts(task, one, lambda _: task, SETTINGS, frame_s=FRAME_S)
    assert not told.loose
    assert np.abs(told.refined.flight.times_s - truth.times_s).max() < 0.05 * FRAME_S
    for found, true in zip(told.refined.flight.bounces, truth.bounces, strict=True):
        assert np.linalg.norm(found.omega - true.omega) < 0.05 * np.linalg.norm(true.omega)


def test_too_few_pictures_beside_an_impact_tell_nothing_of_it() -> None:
    task = seen(bouncing())
    early = replace(bouncing(), bounces=(replace(bouncing().bounces[0], time_s=TIMES[4]),), first=replace(bouncing().first, time_s=0.0))
    assert parted(task, early, 0, FRAME_S) is None
