"""What prior and views know of a surface is marginal over how the views are moved, and so is how the surface answers to motions."""

import numpy as np
import pytest
from scipy.sparse import csr_array, vstack

from estimator.surface.amplitudes import answers_beside, shown
from estimator.surface.arrow import Noise, Weighed, weighed
from estimator.surface.dissection import factorised
from estimator.surface.evenness import Believed, believed
from estimator.surface.samples import Samples
from estimator.surface.star_surface import Surface, sphere
from tests.estimator.surface.made_samples import by_corner

MOVES = 6


@pytest.fixture(scope="module")
def prior() -> Believed:
    return believed(Surface(sphere(2), np.zeros(3), 3e-3 * sphere(2).directions), 0.05)


def of_views(prior: Believed, moves: int) -> Weighed:
    rng = np.random.default_rng(4)
    samples = Samples(0.1 * rng.normal(size=300), np.array([0, 120, 300]), by_corner(prior.sphere, 300, rng), rng.normal(size=(300, moves)))
    return weighed(samples, prior, Noise.white(0.2), 4.0)


def test_information_and_gradient_are_marginal_over_moves(prior: Believed) -> None:
    """As the Schur complement of the whole normal matrix has it."""
    views, known, pull = of_views(prior, MOVES), 2.0 * np.eye(MOVES), np.arange(float(MOVES))
    found = shown(prior, views, known, pull)
    J, F = views.J.toarray(), np.asarray(views.F)
    rows = prior.rows.toarray()
    by = (J.T @ F) @ np.linalg.inv(F.T @ F + known)
    np.testing.assert_allclose(found.information @ np.eye(J.shape[1]), rows.T @ rows + J.T @ J - by @ (F.T @ J), rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(found.gradient, rows.T @ prior.values + J.T @ views.r - by @ (F.T @ views.r + pull), rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("moves", [0, MOVES])
def test_a_surface_answers_to_motions_as_far_as_views_that_may_move_let_it(prior: Believed, moves: int) -> None:
    views, rng = of_views(prior, moves), np.random.default_rng(5)
    lost = shown(prior, views, np.eye(moves), np.zeros(moves)).lost
    factor = factorised(csr_array(vstack([prior.rows, views.J])), prior.corner, prior.sphere)
    border = rng.normal(size=(lost.shape[1], 3))
    J, rows = views.J.toarray(), prior.rows.toarray()
    expected = np.linalg.solve(rows.T @ rows + J.T @ J - lost.T @ lost, border)
    np.testing.assert_allclose(answers_beside(factor, border, lost.T), expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())
