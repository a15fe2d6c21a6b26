"""The factor of a matrix of corners and their neighbours' neighbours, by blocks, is that of the dense matrix."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from estimator.fitting.stable_inverse import NothingSeen
from estimator.surface.dissection import blocks_of, factorised
from estimator.surface.evenness import Believed, believed
from estimator.surface.star_surface import Surface, sphere
from tests.estimator.surface.made_samples import by_corner


def rough(subdivisions: int) -> Surface:
    """One with corners that are free in all directions and others that are not."""
    ball = sphere(subdivisions)
    radii = 3e-3 * (1.0 + 0.03 * np.random.default_rng(2).normal(size=len(ball.directions)))
    return Surface(ball, np.zeros(3), radii[:, None] * ball.directions)


def normal_matrix(prior: Believed) -> csr_array:
    """Of the prior and of as many samples as edges."""
    samples = by_corner(prior.sphere, len(prior.sphere.mesh.ends), np.random.default_rng(5)) @ prior.basis
    return csr_array(prior.rows.T @ prior.rows + samples.T @ samples)


@pytest.mark.parametrize("subdivisions", [0, 1, 3])
def test_solutions_are_those_of_the_dense_matrix(subdivisions: int) -> None:
    prior = believed(rough(subdivisions), 0.05)
    A, right = normal_matrix(prior), np.random.default_rng(1).normal(size=(prior.basis.shape[1], 3))
    found = factorised(A, prior.corner, prior.sphere).solve(right)
    np.testing.assert_allclose(found, np.linalg.solve(A.toarray(), right), rtol=1e-6, atol=1e-9 * np.abs(found).max())


def test_every_corner_is_eliminated_once_and_touches_later_ones_alone() -> None:
    ball = sphere(4)
    blocks = blocks_of(ball)
    eliminated = np.concatenate([block.own for block in blocks])
    assert np.array_equal(np.sort(eliminated), np.arange(len(ball.directions)))
    rank = np.argsort(eliminated)
    for block in blocks:
        assert not len(block.touch) or rank[block.touch].min() > rank[block.own].max()


def test_a_surface_that_nothing_determines_is_refused() -> None:
    prior = believed(rough(2), 0.05)
    with pytest.raises(NothingSeen):
        factorised(csr_array(-normal_matrix(prior)), prior.corner, prior.sphere)


def test_a_matrix_that_joins_far_corners_is_refused() -> None:
    prior = believed(rough(3), 0.05)
    u = prior.basis.shape[1]
    far = csr_array(([1e4, 1e4], ([0, 0], [0, u - 1])), (1, u))
    with pytest.raises(ValueError, match="two edges apart"):
        factorised(csr_array(normal_matrix(prior) + far.T @ far), prior.corner, prior.sphere)
