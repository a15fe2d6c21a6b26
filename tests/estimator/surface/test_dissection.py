"""The factor of the normal matrix of rows that join near corners, by blocks, is that of the dense matrix."""

import numpy as np
import pytest
from scipy.sparse import csr_array, vstack

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


def weighted_rows(prior: Believed) -> csr_array:
    """Of the prior and of as many samples as edges, one of which says nothing."""
    samples = by_corner(prior.sphere, len(prior.sphere.mesh.ends), np.random.default_rng(5)) @ prior.basis
    return csr_array(vstack([prior.rows, samples, csr_array((1, samples.shape[1]))]))


@pytest.mark.parametrize("subdivisions", [0, 1, 3])
def test_solutions_are_those_of_the_dense_matrix(subdivisions: int) -> None:
    prior = believed(rough(subdivisions), 0.05)
    rows, right = weighted_rows(prior), np.random.default_rng(1).normal(size=(prior.basis.shape[1], 3))
    found = factorised(rows, prior.corner, prior.sphere).solve(right)
    np.testing.assert_allclose(found, np.linalg.solve((rows.T @ rows).toarray(), right), rtol=1e-6, atol=1e-9 * np.abs(found).max())


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
        factorised(csr_array(prior.rows.shape), prior.corner, prior.sphere)


def test_a_row_that_joins_far_corners_is_refused() -> None:
    """Corners of the block that is eliminated first, and those that neither lie in it nor are touched by it."""
    prior = believed(rough(3), 0.05)
    first = blocks_of(prior.sphere)[0]
    near = np.flatnonzero(np.isin(prior.corner, first.own))[0]
    far = np.flatnonzero(~np.isin(prior.corner, [*first.own, *first.touch]))[0]
    row = csr_array(([1e4, 1e4], ([0, 0], [near, far])), (1, len(prior.corner)))
    with pytest.raises(ValueError, match="two edges apart"):
        factorised(csr_array(vstack([weighted_rows(prior), row])), prior.corner, prior.sphere)
