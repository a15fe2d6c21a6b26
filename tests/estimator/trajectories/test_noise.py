"""Noise estimated from residuals: size and likeness of neighbouring rows, whatever smooth misfit is beside it."""

import numpy as np
import pytest

from estimator.trajectories.noise import channel_noise


def drawn(rho: float, rng: np.random.Generator, n: int) -> np.ndarray:
    white = rng.normal(size=n)
    found = [white[0]]
    for each in white[1:]:
        found.append(rho * found[-1] + np.sqrt(1.0 - rho**2) * each)
    return np.array(found)


@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_size_and_likeness_are_found_below_a_smooth_misfit(rho: float) -> None:
    rng = np.random.default_rng(1)
    misfit = 20.0 * np.linspace(-1.0, 1.0, 25) ** 3
    noise = channel_noise([3e-4 * (drawn(rho, rng, 25) + misfit) for _ in range(80)])
    # 80 sequences with 19 rows left each: sigma is known to about 2%, rho to 0.05.
    assert noise.sigma == pytest.approx(3e-4, rel=0.08)
    assert noise.rho == pytest.approx(rho, abs=0.12)
    assert noise.repeats == pytest.approx((1 + noise.rho) / (1 - noise.rho))


def test_outliers_do_not_make_the_noise() -> None:
    rng = np.random.default_rng(2)
    residuals = [rng.normal(size=25) for _ in range(40)]
    for r in residuals[::4]:
        r[12] += 10.0
    assert channel_noise(residuals).sigma < 1.3
