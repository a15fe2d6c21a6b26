"""What is compiled for sequences that share nothing is what is worked out in general."""

import numpy as np
import pytest

from estimator.likelihood.reduced import Own
from estimator.likelihood.tails import Noise, Student, weighed_in_turn, with_tails
from tests.estimator.likelihood.test_reduced import FEW, FEW_ROWS, OWN_ROWS, quadratic, sizes


@pytest.mark.parametrize("freedom", [1.0, 3.0])
@pytest.mark.parametrize("few", [FEW, 0])
@pytest.mark.parametrize("noise", [Noise(1.0, 0.0), Noise(0.1, 0.002)])
def test_rounds_are_those_of_the_general_case(few: int, noise: Noise, freedom: float) -> None:
    whole, (sigma, limits, _) = quadratic(3), sizes(3)
    own = Own.of(whole, OWN_ROWS, limits).beside(FEW_ROWS[:few])
    assert own.information.ndim == 1
    found, _ = with_tails(own, Student(0.3, freedom), sigma[:few], noise)
    expected = weighed_in_turn(own, Student(0.3, freedom), sigma[:few], noise)
    for name in ("own", "spread", "precision"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-10, atol=1e-14)
    for name in ("mean", "factor", "misfit", "half_log_det", "covariance"):
        np.testing.assert_allclose(getattr(found.few, name), getattr(expected.few, name), rtol=1e-10, atol=1e-14)
