"""Sums over tangents whose noise is alike, against the dense correlation matrix."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.likelihood.correlated_sums import AlongOutlines
from estimator.likelihood.noise_model import angle_correlation

Array = NDArray[np.float64]
ALIKE_RAD = np.array([0.05, 0.3, 3.0])
"""Of three outlines: shorter and as long as those measured, and so long that half a turn matters."""


def noise(angle: Array, told: NDArray[np.bool_]) -> AlongOutlines:
    """Of tangents (3, m) of three outlines."""
    rng = np.random.default_rng(1)
    own = rng.uniform(0.1, 1.0, angle.shape)
    outline = np.where(told, np.arange(3)[:, None], -1)
    variance = own**2 + rng.uniform(0.0, 0.5, angle.shape)
    return AlongOutlines(outline.ravel(), angle.ravel(), own.ravel(), variance.ravel(), ALIKE_RAD)


def dense(of: AlongOutlines) -> Array:
    """Covariance (N, N)."""
    total = np.zeros((len(of.angle),) * 2)
    for i, alike in enumerate(ALIKE_RAD):
        here = np.flatnonzero(of.outline == i)
        K = np.outer(of.own[here], of.own[here]) * angle_correlation(of.angle[here], float(alike))
        np.fill_diagonal(K, of.variance[here])
        total[np.ix_(here, here)] = K
    return total


def compared(angle: Array, told: NDArray[np.bool_]) -> None:
    of, weights = noise(angle, told), np.random.default_rng(2).normal(size=(angle.size, 4))
    expected = weights.T @ dense(of) @ weights
    np.testing.assert_allclose(of.covariance(weights), expected, atol=1e-12 * max(np.abs(expected).max(), 1.0))


@pytest.mark.parametrize("m", [1, 2, 3, 80, 640])
def test_as_the_dense_matrix_says(m: int) -> None:
    rng = np.random.default_rng(m)
    compared(rng.uniform(-np.pi, np.pi, (3, m)), rng.random((3, m)) > 0.2)


def test_all_on_one_side_and_across_the_seam() -> None:
    rng = np.random.default_rng(5)
    seam = rng.uniform(2.0, 4.2, (3, 30))
    compared(np.arctan2(np.sin(seam), np.cos(seam)), np.ones((3, 30), dtype=bool))
    compared(rng.uniform(-0.5, 0.5, (3, 30)), np.ones((3, 30), dtype=bool))


def test_tangents_alike_and_tangents_exactly_opposite_are_counted_once() -> None:
    """Outlines on pixel grids have many tangents with the very same normal, and many with the opposite one."""
    angle = np.arctan2(*np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0])).ravel()
    compared(np.tile(np.repeat(angle, 2), (3, 1)), np.ones((3, 18), dtype=bool))
    compared(np.full((3, 5), -np.pi), np.ones((3, 5), dtype=bool))
    compared(np.tile([-np.pi, np.pi, 0.0], (3, 1)), np.ones((3, 3), dtype=bool))


def test_what_is_left_out_does_not_count_whatever_it_is() -> None:
    rng = np.random.default_rng(6)
    angle, told = rng.uniform(-np.pi, np.pi, (3, 20)), rng.random((3, 20)) > 0.5
    of, weights = noise(angle, told), rng.normal(size=(60, 2))
    unknown = noise(np.where(told, angle, np.nan), told)
    np.testing.assert_array_equal(unknown.covariance(weights), of.covariance(weights))
    assert (of.half(weights)[~told.ravel()] == 0.0).all()
    assert not noise(angle, np.zeros_like(told)).covariance(weights).any()
    assert of.covariance(weights[:, :0]).shape == (0, 0)
