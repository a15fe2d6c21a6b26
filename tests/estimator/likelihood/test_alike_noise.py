"""Noise estimated from residuals: size and likeness of neighbouring rows, whatever smooth misfit is beside it."""

import numpy as np
import pytest

from estimator.likelihood.alike_noise import CLIP, axis_rows, channel_noise, less_explained, noise_of, surprise


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
    assert noise is not None
    # 80 sequences with 19 rows left each: sigma is known to about 2%, rho to 0.05.
    assert noise.sigma == pytest.approx(3e-4, rel=0.08)
    assert noise.first == pytest.approx(rho, abs=0.12)
    assert noise.repeats == pytest.approx((1 + rho) / (1 - rho), rel=0.25)


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("width", [2, 3])
def test_rows_that_are_alike_over_a_few_weigh_as_so_many_times_the_variance(width: int, stated: bool) -> None:
    """Moving means of white noise: no autoregressive process."""
    rng = np.random.default_rng(3)
    residuals = [np.convolve(rng.normal(size=62), np.ones(width) / np.sqrt(width))[width:60] for _ in range(20)]
    noise = channel_noise(residuals, stated=stated)
    assert noise is not None
    assert noise.sigma == pytest.approx(1.0, rel=0.1)
    assert noise.repeats == pytest.approx(width, rel=0.1 if width == 2 else 0.5)  # no ARMA(1, 1) is a mean of three


def test_what_is_larger_than_stated_is_not_taken_for_noise() -> None:
    """A shake of five standard deviations in ten rows is alike from row to row, but stated noise is not so large."""
    rng = np.random.default_rng(4)
    residuals = [rng.normal(size=40) + 5.0 * np.sin(2.0 * np.pi * np.arange(40) / 10.0 + rng.uniform(0.0, 6.0)) for _ in range(20)]
    noise, believed = channel_noise(residuals), channel_noise(residuals, stated=True)
    assert noise is not None
    assert believed is not None
    assert (believed.sigma, believed.repeats) == (1.0, 1.0)
    assert noise.repeats > 3.0


def test_rows_far_off_count_as_a_fit_believes_them() -> None:
    rng = np.random.default_rng(2)
    residuals = [rng.normal(size=25) for _ in range(40)]
    for r in residuals:
        r[rng.integers(25)] += 20.0
    noise = channel_noise(residuals)
    assert noise is not None
    assert noise.sigma == pytest.approx(np.sqrt(1.0 + CLIP**2 / 25.0), rel=0.1)
    assert noise.repeats < 1.3


def test_where_polynomials_leave_nothing_there_is_no_noise_to_be_told() -> None:
    assert channel_noise([np.ones(1), np.arange(2.0)]) is None


def test_polynomials_are_of_time_where_rows_are_not_evenly_spaced() -> None:
    """A third of the rows was not seen: what is smooth in time is not smooth in the number of the row."""
    rng = np.random.default_rng(7)
    times = [np.sort(rng.choice(np.arange(40), size=26, replace=False)) / 40.0 for _ in range(30)]
    residuals = [rng.normal(size=len(t)) + 100.0 * (2.0 * t - 1.0) ** 3 for t in times]
    noise, by_number = channel_noise(residuals, times), channel_noise(residuals)
    assert noise is not None
    assert by_number is not None
    assert noise.sigma == pytest.approx(1.0, rel=0.1)
    assert noise.repeats < 1.2
    assert by_number.sigma > 1.5


def test_what_an_effect_makes_is_taken_off_beside_polynomials_with_one_amplitude() -> None:
    rng = np.random.default_rng(8)
    times = [np.linspace(0.0, 1.0, 18) for _ in range(3)]
    shapes = [np.column_stack([np.exp(-5.0 * t), 1.0 + t]) for t in times]
    residuals = [rng.normal(size=18) + 60.0 * shape[:, 0] for shape in shapes]
    less, amplitudes = less_explained(residuals, times, shapes)
    assert amplitudes[0] == pytest.approx(60.0, rel=0.2)
    assert amplitudes[1] == 0.0  # a straight line is a polynomial already
    before, after = channel_noise(residuals, times), channel_noise(less, times)
    assert before is not None
    assert after is not None
    assert surprise(less, times, after) < surprise(residuals, times, before) - 20.0


def test_polynomials_of_long_sequences_are_those_of_their_pieces() -> None:
    """A gyroscope writes a hundred thousand rows: what is smooth within one piece is no noise, and no matrix is as large as all rows."""
    rng = np.random.default_rng(9)
    pieces, rows = 200, 500
    times = 1e-3 * np.arange(pieces * rows)
    smooth = np.tile(200.0 * np.linspace(-1.0, 1.0, rows) ** 5, pieces)
    shape = np.sin(40.0 * times)[:, None]
    residuals = rng.normal(size=len(times)) + smooth
    noise = channel_noise([residuals], [times])
    assert noise is not None
    assert noise.sigma == pytest.approx(1.0, rel=0.02)
    _, amplitudes = less_explained([residuals + 3.0 * shape[:, 0]], [times], [shape])
    assert amplitudes[0] == pytest.approx(3.0, abs=0.05)


def test_a_little_more_misfit_changes_noise_by_little() -> None:
    """Three axes that are more and less alike: no jump from one likeness to another."""
    rng = np.random.default_rng(16)
    axes = [[drawn(rho, rng, int(n)) for n in rng.integers(20, 40, size=8)] for rho in (0.3, 0.5, 0.1)]
    found = []
    for share in np.linspace(0.0, 0.5, 11):
        told = [axis_rows([r + share * np.linspace(-1.0, 1.0, len(r)) ** 5 for r in axis]) for axis in axes]
        found.append([(noise.sigma, noise.repeats) for noise in noise_of([each for each in told if each is not None])])
    assert np.abs(np.diff(np.log(found), axis=0)).max() < 0.01


def test_rows_that_say_nothing_of_likeness_are_independent_or_not_at_even_odds() -> None:
    axis = axis_rows([np.array([0.0, 1.0, -1.0, 0.5, 2.0])])
    assert axis is not None
    (noise,) = noise_of([axis])
    assert 1.05 < noise.repeats < 2.0
