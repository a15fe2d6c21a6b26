"""A step without the surface is that of the dense normal equations of everything."""

import numpy as np
import pytest

from estimator.surface.arrow import Noise, Whole, _alike, _lagged_products, eliminated, weighed, with_columns
from estimator.surface.evenness import believed
from estimator.surface.samples import Samples
from estimator.surface.star_surface import Surface, sphere
from tests.estimator.surface.made_samples import by_corner

MOTIONS, ROWS, NOISE_PX = 4, 300, 0.2


def test_elimination_gives_the_step_of_the_dense_equations() -> None:
    rng = np.random.default_rng(3)
    surface = Surface(sphere(2), np.zeros(3), 3e-3 * sphere(2).directions)
    n = 3 * len(surface.vertices)
    samples = Samples(
        0.1 * rng.normal(size=ROWS), np.array([0, 120, ROWS]), by_corner(surface.sphere, ROWS, rng), rng.normal(size=(ROWS, MOTIONS))
    )
    whole = Whole(rng.normal(size=3), rng.normal(size=(3, MOTIONS)), 1e2 * rng.normal(size=(n, 3)))
    prior = believed(surface, 0.05)
    group = weighed(samples, prior, Noise.white(NOISE_PX), 4.0)
    found = eliminated([group], prior, whole)

    rows = np.vstack([group.J.toarray(), prior.rows.toarray(), -(prior.basis.T @ whole.by_corner).T])
    motions = np.vstack([group.F, np.zeros((len(prior.values), MOTIONS)), whole.by_motion])
    A, r = np.hstack([rows, motions]), np.concatenate([group.r, prior.values, whole.residual])
    dense = -np.linalg.lstsq(A, r, rcond=None)[0]
    step = -np.linalg.solve(found.H, found.g)
    np.testing.assert_allclose(step, dense[-MOTIONS:], rtol=1e-6)
    np.testing.assert_allclose(found.corners(step).ravel(), prior.basis @ dense[:-MOTIONS], rtol=1e-5, atol=1e-10)
    np.testing.assert_allclose(np.linalg.inv(found.H), np.linalg.inv(A.T @ A)[-MOTIONS:, -MOTIONS:], rtol=1e-5)


def test_more_parameters_of_the_motions_are_as_if_they_had_been_there() -> None:
    """Of two groups; those of the second are moved by two more parameters, from the fourth place on."""
    rng = np.random.default_rng(8)
    surface = Surface(sphere(2), np.zeros(3), 3e-3 * sphere(2).directions)
    prior = believed(surface, 0.05)

    def samples(by_motion: np.ndarray) -> Samples:
        return Samples(gaps[len(by_motion)], np.array([0, len(by_motion)]), corners[len(by_motion)], by_motion)

    gaps = {count: 0.1 * rng.normal(size=count) for count in (200, ROWS)}
    corners = {count: by_corner(surface.sphere, count, rng) for count in gaps}
    first, second, more = rng.normal(size=(200, 2)), rng.normal(size=(ROWS, MOTIONS - 1)), rng.normal(size=(ROWS, 2))
    whole = Whole(rng.normal(size=3), rng.normal(size=(3, 5)), 1e2 * rng.normal(size=(surface.vertices.size, 3)))
    few = [
        weighed(samples(first), prior, Noise.white(NOISE_PX), 4.0, np.array([3, 4])),
        weighed(samples(second), prior, Noise.white(NOISE_PX), 4.0, np.arange(3)),
    ]
    columns = few[1].weight[:, None] * more
    found, found_whole = with_columns(eliminated(few, prior, whole), whole, [columns], 3)

    every = [
        weighed(samples(first), prior, Noise.white(NOISE_PX), 4.0, np.array([5, 6])),
        weighed(samples(np.column_stack([second, more])), prior, Noise.white(NOISE_PX), 4.0, np.arange(5)),
    ]
    padded = Whole(whole.residual, np.insert(whole.by_motion, [3, 3], 0.0, axis=1), whole.by_corner)
    told = eliminated(every, prior, padded)
    for name in ("H", "g", "half"):
        np.testing.assert_allclose(getattr(found, name), getattr(told, name), rtol=1e-9, atol=1e-9 * np.abs(getattr(told, name)).max())
    np.testing.assert_array_equal(found_whole.by_motion, padded.by_motion)
    for group, of in zip(found.groups, told.groups, strict=True):
        np.testing.assert_array_equal(group.place, of.place)
        np.testing.assert_allclose(group.F, of.F)


def test_residuals_alike_over_neighbours_count_as_fewer() -> None:
    rng = np.random.default_rng(1)
    starts, white = np.arange(0, 4001, 200), rng.normal(size=4000)
    z = white[:200]
    np.testing.assert_allclose(_lagged_products(z, np.array([0, 200]))[:3], [z @ np.roll(z, lag) / 200.0 for lag in range(3)], rtol=1e-9)
    alike = np.concatenate([sum(np.roll(white[a : a + 200], k) for k in range(4)) for a in starts[:-1]])
    assert 0.8 < _alike(white, starts) < 1.5
    assert 3.0 < _alike(alike, starts) < 5.5, "sums over four neighbours: 1 + 2 (3/4 + 2/4 + 1/4) = 4"
    beside = np.concatenate([starts, [4003, 4003]])
    assert _alike(np.concatenate([alike, white[:3]]), beside) == pytest.approx(_alike(alike, starts), rel=0.01), "a short arc and none"
