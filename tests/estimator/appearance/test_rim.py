"""Support points by direction: the octahedral table against a search over the vertices."""

import numpy as np

from estimator.appearance.rim import _cell, _directions, rim_of


def test_every_cell_is_found_again_from_its_middle() -> None:
    directions = _directions()
    assert np.array_equal(_cell(directions), np.arange(len(directions)))
    assert np.array_equal(_cell(7.0 * directions), np.arange(len(directions)))


def test_the_point_found_lies_almost_as_far_out_as_the_furthest() -> None:
    rng = np.random.default_rng(4)
    vertices = rng.normal(size=(300, 3)) * [3e-3, 2e-3, 1e-3]
    normals = rng.normal(size=(50, 40, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    found = rim_of(vertices).furthest(normals)
    furthest = (normals @ vertices.T).max(axis=-1)
    reached = np.sum(found * normals, axis=-1)
    # A cell's middle is at most 2 degrees from any direction in it; the support falls by at most the angle times twice the body's reach.
    assert np.all(furthest - reached <= np.radians(2.0) * 2.0 * np.linalg.norm(vertices, axis=1).max())
    assert np.mean(np.abs(furthest - reached) < 1e-12) > 0.9


def test_a_sphere_is_touched_where_its_normal_points() -> None:
    rng = np.random.default_rng(5)
    sphere = rng.normal(size=(20_000, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    normals = rng.normal(size=(500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    apart = np.degrees(np.arccos(np.clip(np.sum(rim_of(sphere).furthest(normals) * normals, axis=1), -1, 1)))
    assert np.median(apart) < 2.0
    assert apart.max() < 3.5
