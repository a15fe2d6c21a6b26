"""Normal matrices in units far apart are inverted; one that says nothing of a parameter is told from them."""

import numpy as np
import pytest
from scipy.linalg import hilbert

from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.stable_inverse import LEAST_SEEN, NothingSeen, determined, inverse_of_all, scaled_inverse, stable_inverse
from estimator.fitting.system import Arrangement, System


def test_units_far_apart() -> None:
    scale = np.array([1e-8, 1.0, 1e9])
    A = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.2], [0.0, 0.2, 3.0]])
    inverse = scaled_inverse(A * scale[:, None] * scale)
    np.testing.assert_allclose(inverse * scale[:, None] * scale, np.linalg.inv(A), atol=1e-12)


def test_a_parameter_that_nothing_says_anything_of() -> None:
    with pytest.raises(NothingSeen, match="nothing is seen of a parameter"):
        scaled_inverse(np.diag([1.0, 0.0, 2.0]))
    for inverse in (determined, stable_inverse):
        with pytest.raises(NothingSeen, match="nothing is seen of a parameter"):
            inverse(np.diag([1.0, np.nan, 2.0]))


def test_a_matrix_that_is_singular_but_for_rounding() -> None:
    """Its inverse exists, of rounding alone: variances may come out negative."""
    H = hilbert(16)
    assert np.diag(np.linalg.inv(H)).min() < 0.0
    with pytest.raises(NothingSeen, match="nothing is seen of a parameter"):
        determined(H)
    np.testing.assert_array_equal(determined(H[:6, :6]), H[:6, :6])


def test_steps_and_covariances_leave_out_the_same() -> None:
    H = np.array([[1.0, 1.0 - 2e-11], [1.0 - 2e-11, 1.0]])
    told = NormalEquations(H, np.ones(2), 0.0)
    system = System((told,), Arrangement((np.arange(2),), 2), NormalEquations(np.zeros((2, 2)), np.zeros(2), 0.0), 0.0)
    assert determined(H) is H
    np.testing.assert_allclose(system.solved().shared, scaled_inverse(H))
    np.testing.assert_allclose(system.sandwich(H), scaled_inverse(H), rtol=1e-4)


@pytest.mark.parametrize("seen", [1.0, 1e-4, 1e-12])
def test_the_inverse_of_all_is_the_stable_one_however_little_is_seen(seen: float) -> None:
    rng = np.random.default_rng(5)
    J = rng.normal(size=(80, 12)) * np.geomspace(1e-3, 1e5, 12)
    J[:, 4] = 0.0
    J[:, 7] = J[:, 8] * 1e-2 + np.sqrt(seen) * J[:, 7]
    H = J.T @ J
    scale = np.sqrt(np.maximum(np.diag(H), 1.0))
    expected = stable_inverse(H, LEAST_SEEN) * np.outer(scale, scale)
    np.testing.assert_allclose(inverse_of_all(H) * np.outer(scale, scale), expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
