"""What is believed of a surface: faces cost nothing, edges little, and corners at edges alone are free along the surface."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array, vstack
from scipy.sparse.linalg import spsolve

from estimator.surface.evenness import BENT, Believed, believed, slowed
from estimator.surface.shape import scale_in
from estimator.surface.star_surface import Surface, sphere

ROUGHNESS, HALF_M = 0.03, 3e-3


def cube() -> Surface:
    ball = sphere(4)
    return Surface(ball, np.zeros(3), HALF_M * ball.directions / np.abs(ball.directions).max(axis=1)[:, None])


@pytest.fixture(scope="module")
def prior() -> Believed:
    return believed(cube(), ROUGHNESS)


def of_face(surface: Surface) -> np.ndarray:
    """Corners that lie on one side of the cube with all their neighbours."""
    side = np.argmax(np.abs(surface.vertices), axis=1)
    ends = surface.sphere.mesh.ends
    return np.setdiff1d(np.arange(len(side)), ends[side[ends[:, 0]] != side[ends[:, 1]]])


def test_a_flat_side_has_no_bend_and_an_edge_a_bounded_cost(prior: Believed) -> None:
    inner = of_face(cube())
    assert 0 < len(inner) < len(prior.bend)
    np.testing.assert_allclose(prior.bend[inner], 0.0, atol=1e-9)
    assert np.abs(prior.bend).max() < np.sqrt(2.0)
    assert np.abs(prior.bend).max() > 0.5


def test_only_corners_at_edges_are_free_along_the_surface(prior: Believed) -> None:
    n = len(prior.bend)
    free = (prior.basis.shape[1] - n) // 2
    assert len(prior.apart) == 2 * free
    assert 0 < free <= n - len(of_face(cube()))
    assert believed(cube(), ROUGHNESS, bent=np.inf).basis.shape == (3 * n, n)


def test_rows_tell_how_the_bend_changes() -> None:
    surface, roughness = cube(), 1e3  # weights do not change then
    prior = believed(surface, roughness)
    unknowns = 1e-8 * np.random.default_rng(5).normal(size=prior.basis.shape[1])
    after = believed(surface.moved((prior.basis @ unknowns).reshape(-1, 3)), roughness, bent=BENT)
    inner = of_face(surface)
    np.testing.assert_allclose(
        (after.bend - prior.bend)[inner], (prior.bends @ unknowns)[inner], rtol=0.02, atol=1e-3 * np.abs(after.bend).max()
    )


def height(surface: Surface) -> np.ndarray:
    """How far corners lie out of the cube, in lengths of an edge."""
    return (np.abs(surface.vertices).max(axis=1) - HALF_M) / surface.edge_m


def flattened(surface: Surface, scales: list[float]) -> Surface:
    """The surface after rounds of the prior alone, with corners beside the cube's edges held to a fiftieth of an edge."""
    seen = np.ones(len(surface.vertices))
    seen[of_face(cube())] = 0.0
    for scale in scales:
        prior = believed(surface, scale, bent=np.inf)
        rows = csc_array(vstack([prior.rows, diags_array(50.0 * seen / surface.edge_m)]))
        values = np.concatenate([prior.values, 50.0 * seen * height(surface)])
        surface = surface.moved((prior.basis @ spsolve(csc_array(rows.T @ rows), -rows.T @ values)).reshape(-1, 3))
    return surface


def test_faces_that_nothing_shows_become_flat_and_edges_stay() -> None:
    flat = cube()
    u = np.sort(np.abs(flat.vertices), axis=1)[:, :2] / HALF_M
    pillow = flat.moved(2.0 * flat.edge_m * ((1.0 - u**2).prod(axis=1))[:, None] * flat.sphere.directions)
    inner = of_face(flat)
    assert height(pillow)[inner].max() > 1.5
    found = flattened(pillow, [scale_in(number) for number in range(16)])
    assert np.abs(height(found)).max() < 0.05


def test_a_wall_seen_edge_on_from_the_centre_moves_along_its_normal() -> None:
    """Moves along the direction from the centre would leave it where it is."""
    surface = replace(cube(), centre=np.array([0.999 * HALF_M, 0.0, 0.0]))
    wall = np.intersect1d(np.flatnonzero(surface.vertices[:, 0] > (1.0 - 1e-9) * HALF_M), of_face(surface))
    moves = believed(surface, ROUGHNESS, bent=np.inf).basis.toarray().reshape(-1, 3, len(surface.vertices))
    assert len(wall) > 0
    np.testing.assert_allclose(moves[wall, 0, wall], 1.0, atol=1e-9)


def test_a_slowed_step_throws_up_no_spike_and_is_at_rest_where_nothing_pulls() -> None:
    surface = cube()
    prior, corner = believed(surface, 10.0, bent=np.inf), int(of_face(cube())[0])
    free, slow = (_drawn(each, surface, corner) for each in (prior, slowed(prior, surface, 0.1)))
    assert free > 1.0
    assert abs(slow) < 0.2 * free
    np.testing.assert_allclose(slowed(prior, surface, 0.1).values[len(prior.values) :], 0.0)


def _drawn(prior: Believed, surface: Surface, corner: int) -> float:
    """How far, in lengths of an edge, one sample draws a ``corner`` beyond its neighbours that wants it two of these further outwards."""
    sample = csc_array(([1.0], ([0], [corner])), shape=(1, prior.basis.shape[1])) / surface.edge_m
    rest = diags_array(np.full(prior.basis.shape[1], 0.1 / surface.edge_m))
    rows = csc_array(vstack([prior.rows, rest, sample]))
    right = np.append(np.zeros(rows.shape[0] - 1), 2.0)
    moves = spsolve(csc_array(rows.T @ rows), rows.T @ right)
    return float((surface.sphere.laplacian @ moves)[corner] / surface.edge_m)
