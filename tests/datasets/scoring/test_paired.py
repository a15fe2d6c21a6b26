"""Paired comparisons: intervals that hold as often as they say, and what is not measured."""

import numpy as np
import pytest

from datasets.scoring.paired import differences, log_ratios, paired

LEVEL = 0.025


def test_errors_that_are_all_larger_by_a_factor() -> None:
    first = np.array([1.0, 2.0, 3.0, 4.0])
    found = paired(log_ratios(first, 2.0 * first), cut=3.0, level=LEVEL)
    assert found.n == 4
    assert 1.5 < found.low < found.ratio < found.high < 2.0
    assert paired(log_ratios(first, first), cut=3.0, level=LEVEL).ratio == 1.0


def test_an_error_near_zero_by_luck_decides_nothing() -> None:
    first = np.array([1e-12, 1.0, 1.0, 1.0])
    assert log_ratios(first, np.ones(4))[0] == pytest.approx(np.log(1.25 / 0.25))
    assert log_ratios(first, np.ones(4), least=2.0)[0] == pytest.approx(np.log(1.5))


def test_what_is_not_measured_is_cut_and_what_neither_measures_left_out() -> None:
    first, second = np.array([1.0, np.nan, np.nan, 1.0]), np.array([np.nan, 1.0, np.nan, 1.0])
    found = paired(log_ratios(first, second), cut=3.0, level=LEVEL)
    assert np.exp(found.log_ratios) == pytest.approx([3.0, 1.0 / 3.0, np.nan, 1.0], nan_ok=True)
    assert (found.n, found.ratio) == (3, pytest.approx(1.0))
    assert paired(np.array([np.nan]), cut=3.0, level=LEVEL).high == np.inf


def test_logarithms_are_compared_by_their_difference() -> None:
    assert differences(np.array([0.5, np.nan]), np.array([0.75, 1.0])).tolist() == [0.25, -np.inf]


@pytest.mark.parametrize("n", [6, 8, 20])
def test_two_that_fail_as_often_are_rarely_called_different(n: int) -> None:
    """Somewhat more often than 5%: what either loses lies at the cut."""
    rng, decided = np.random.default_rng(8), 0
    for _ in range(1000):
        first, second = (np.where(rng.random(n) < 0.5, np.nan, np.abs(rng.normal(size=n))) for _ in range(2))
        found = paired(log_ratios(first, second), cut=100.0, level=LEVEL)
        decided += found.low > 1 or found.high < 1
    assert decided / 1000 < 0.09


@pytest.mark.parametrize("cut", [3.0, 100.0])
def test_two_that_are_alike_are_rarely_called_different(cut: float) -> None:
    rng, decided = np.random.default_rng(3), 0
    for _ in range(1000):
        first, second = np.abs(rng.normal(size=(2, 8)))
        found = paired(log_ratios(first, second), cut=cut, level=LEVEL)
        decided += found.low > 1 or found.high < 1
    assert decided / 1000 < 0.06
