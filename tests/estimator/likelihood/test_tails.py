"""What is compiled is what is worked out in plain steps, for sequences that share nothing and those that do, of one effect and two."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.likelihood.reduced import Own, Quadratic, posterior
from estimator.likelihood.tails import AT_ONCE, MOST_WEIGHED, WEIGHED, Noise, Student, Weighed, with_tails
from tests.estimator.likelihood.test_reduced import FEW, FEW_ROWS, eliminated, quadratic, sizes, taken_out, units


def _in_plain_steps(own: Own, student: Student, sigma: NDArray[np.float64], noise: Noise) -> Weighed:
    scale, freedom, q = student.scale, student.freedom, own.sums(np.ones(len(own.group)))
    w = np.ones(len(q))
    for _ in range(MOST_WEIGHED):
        quadratic, covariance = eliminated(own, scale**2 / w)
        shared = posterior(quadratic, sigma)
        values, variance = units(own, covariance, shared.mean), np.diag(covariance)
        square = values**2 / noise.at(shared.misfit)
        size = freedom + own.sums(square + variance) / scale**2
        rate = w * own.sums(variance * (variance + 2.0 * square)) / (size * scale**4)
        step = np.log((freedom + q) / (size * w))
        most = np.maximum(np.abs(step), AT_ONCE)
        step = np.clip(step / np.maximum(1.0 - rate, 1.0 / AT_ONCE), -most, most)
        w = w * np.exp(step)
        if np.abs(step).max() < WEIGHED:
            break
    return Weighed(shared, values, variance, w)


@pytest.mark.parametrize("freedom", [1.0, 3.0])
@pytest.mark.parametrize("few", [FEW, 0])
@pytest.mark.parametrize("noise", [Noise(1.0, 0.0), Noise(0.1, 0.002)])
@pytest.mark.parametrize("hanging", [False, True])
@pytest.mark.parametrize("effects", [1, 2])
def test_rounds_are_those_in_plain_steps(few: int, noise: Noise, freedom: float, hanging: bool, effects: int) -> None:
    whole, (sigma, limits, _) = quadratic(3, hanging=hanging), sizes(3)
    own = taken_out(whole, limits, effects=effects).beside(FEW_ROWS[:few])
    groups = np.arange(own.group[-1] + 1) % effects
    student = Student(0.3 + 0.5 * groups, freedom + groups)
    found, _ = with_tails(own, student, sigma[:few], noise)
    expected = _in_plain_steps(own, student, sigma[:few], noise)
    for name in ("own", "spread", "precision"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-10, atol=1e-14)
    for name in ("mean", "factor", "misfit", "half_log_det", "covariance"):
        np.testing.assert_allclose(getattr(found.few, name), getattr(expected.few, name), rtol=1e-10, atol=1e-14)


def test_values_that_are_the_same_thing_twice_are_factorised_at_any_scale() -> None:
    """Of two effects that do the same rounding leaves less than nothing where priors are ever so wide: half of each is as probable."""
    G, b = 1e6 * np.ones((2, 2)) - 1e-9 * np.eye(2), np.array([2e6, 2e6])
    whole = Quadratic(G, b, 4e6 + 3.0)
    own = Own.of(whole, (np.array([0]), np.array([1])), np.zeros(2, dtype=np.int64), np.ones(2)).beside(np.zeros(0, dtype=np.int64))
    found, tails = with_tails(own, Student(np.full(2, 1e8), np.full(2, 3.0)), np.zeros(0), Noise(1.0, 0.0))
    assert np.isfinite(tails)
    assert found.own.sum() == pytest.approx(2.0, rel=1e-2)
