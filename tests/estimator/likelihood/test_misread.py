"""Readings of spins that are of other flights are told by the lifts that flights show, whatever the law of lift is."""

import numpy as np
import pytest

from estimator.likelihood.misread import Lifts, probably_misread

Array = np.ndarray
LIFT, SATURATES_M, SPEED_MS, NOISE = 7e-3, 0.08, 8.0, 0.05


def readings(rng: np.random.Generator, number: int) -> Array:
    """Spins of 30 to 400 rad/s across the flight, of any direction."""
    angle, size = rng.uniform(0.0, 2.0 * np.pi, number), rng.uniform(30.0, 400.0, number)
    return np.column_stack([size * np.cos(angle), size * np.sin(angle)])


def made(number: int, wrong: int, seed: int, *, saturates: float = SATURATES_M) -> Lifts:
    """Flights, the first of which have ``wrong`` readings."""
    rng = np.random.default_rng(seed)
    true = readings(rng, number)
    read = np.vstack([readings(rng, wrong), true[wrong:]])
    size = np.linalg.norm(true, axis=1, keepdims=True)
    shown = LIFT * true / (1.0 + saturates * size / SPEED_MS) + rng.normal(0.0, NOISE, true.shape)
    return Lifts(shown, np.tile(NOISE**2 * np.eye(2), (number, 1, 1)), read, np.linalg.norm(read, axis=1) / SPEED_MS)


@pytest.mark.parametrize("wrong", [0, 4, 12])
def test_readings_of_other_flights_are_told_and_right_ones_are_kept(wrong: int) -> None:
    every = [probably_misread(made(30, wrong, seed)) for seed in range(20)]
    assert np.mean([each[wrong:] > 0.95 for each in every]) < 0.005
    assert wrong == 0 or np.mean([each[:wrong] > 0.95 for each in every]) > 0.75


@pytest.mark.parametrize("saturates", [0.0, 1.0])
def test_slow_and_fast_spins_are_no_wrong_ones_where_lift_saturates_or_does_not(saturates: float) -> None:
    every = [probably_misread(made(20, 0, seed, saturates=saturates)) for seed in range(20)]
    assert max(each.max() for each in every) < 0.95


def test_one_flight_does_not_tell() -> None:
    assert max(probably_misread(made(1, wrong, seed)).max() for wrong in (0, 1) for seed in range(20)) < 0.95


def test_where_nothing_says_how_flights_are_lifted_all_is_as_probable_as_before() -> None:
    few = made(20, 10, 3)
    blind = Lifts(few.shown, 1e6 * few.covariance, few.read, few.spin_per_speed)
    assert np.ptp(probably_misread(blind)) < 0.02


def test_units_do_not_matter() -> None:
    lifts = made(12, 4, 5)
    other = Lifts(1e3 * lifts.shown, 1e6 * lifts.covariance, 60.0 * lifts.read, 60.0 * lifts.spin_per_speed)
    assert probably_misread(other) == pytest.approx(probably_misread(lifts), abs=1e-9)


def test_spins_of_nothing_lift_nothing() -> None:
    lifts = made(5, 0, 1)
    assert not probably_misread(Lifts(lifts.shown, lifts.covariance, 0.0 * lifts.read, 0.0 * lifts.spin_per_speed)).any()
