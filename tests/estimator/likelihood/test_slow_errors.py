"""Slow errors: their curves are those of an integrated Wiener process, and their size is found beside what a flight has for itself."""

import numpy as np
import pytest

from estimator.effects.instrument.slow_errors import CURVES, SlowErrors, curves
from estimator.effects.link import Setting
from estimator.likelihood.slow_errors import Told, size_of

Array = np.ndarray
TIMES = np.linspace(0.3, 0.9, 60)
STRAIGHT = np.column_stack([np.ones_like(TIMES), TIMES])


def less_straight(rows: Array) -> Array:
    Q, _ = np.linalg.qr(STRAIGHT)
    return np.asarray(rows - Q @ (Q.T @ rows))


def covariance() -> Array:
    """Of the process from the first row on [Wahba 1978]."""
    s, t = np.minimum.outer(TIMES, TIMES) - TIMES[0], np.maximum.outer(TIMES, TIMES) - TIMES[0]
    return np.asarray(s**2 * (3.0 * t - s) / 6.0)


def told(rng: np.random.Generator, size: float, noise: float) -> Told:
    """What a flight of such slow errors says, whose start is not known."""
    off = np.linalg.cholesky(covariance()[1:, 1:]) @ rng.normal(size=len(TIMES) - 1)
    y, made = size * np.concatenate([[0.0], off]) + noise * rng.normal(size=len(TIMES)), less_straight(curves(TIMES)) / noise
    return Told.of(made.T @ made, made.T @ less_straight(y) / noise, float(np.sum(made[:, 0] ** 2)))


def test_curves_are_those_of_an_integrated_wiener_process() -> None:
    made = less_straight(less_straight(covariance()).T)
    seen = less_straight(curves(TIMES))
    np.testing.assert_allclose(seen @ seen.T, made, atol=0.01 * made.max())


@pytest.mark.parametrize("size", [0.005, 0.05])
def test_their_size_is_found(size: float) -> None:
    rng = np.random.default_rng(3)
    found, gain = size_of([told(rng, size, 5e-4) for _ in range(12)], 5e-4 / float(np.abs(curves(TIMES)).max()))
    assert abs(np.log(found / size)) < 0.3
    assert gain > 5.0


def test_noise_alone_says_that_there_are_none() -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        _, gain = size_of([told(rng, 0.0, 5e-4) for _ in range(12)], 5e-4 / float(np.abs(curves(TIMES)).max()))
        assert gain < 0.0


def test_a_flight_of_three_rows_says_nothing_of_what_all_else_takes() -> None:
    rng = np.random.default_rng(3)
    basis, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    made = curves(TIMES[:3])
    left = made - basis @ (basis.T @ made)  # rounding
    assert len(Told.of(left.T @ left, left.T @ rng.normal(size=3), float(np.sum(made**2))).pull) == 0
    assert size_of([], 1.0)[1] == pytest.approx(0.0)


def test_rows_move_by_the_curves_as_derivatives_say() -> None:
    slow = SlowErrors(np.array([0.1, 0.0, 0.3]))
    setting = Setting(TIMES, 0.0, np.array([0.0, 0.0, -9.81]), np.ones(3))
    rng = np.random.default_rng(5)
    theta, x = rng.normal(size=3 * CURVES), rng.normal(size=(len(TIMES), 3))
    np.testing.assert_allclose(slow.tracked(theta, x, setting) - x, slow.tracked_by(theta, x, setting) @ theta, atol=1e-12)
