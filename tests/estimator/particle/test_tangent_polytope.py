"""The polytope of tangent planes: a body's own corners, bounds, and planes that leave nothing."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from datasets.errors import InputError
from estimator.geometry.silhouettes import Silhouettes
from estimator.particle.tangent_polytope import tangent_polytope
from tests.estimator.exact import ellipsoid_views, exact_silhouettes, pose_set, rig

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 2e-3


def _cube_views(drops: int) -> tuple[Silhouettes, list[np.ndarray]]:
    views = rig(drops)
    rings = []
    for view in views:
        pixels = view.intrinsics.project(CUBE @ view.R_cam_particle.T + view.t_cam_particle)
        rings.append(pixels[ConvexHull(pixels).vertices])
    return exact_silhouettes(rings, [v.intrinsics for v in views]), rings


def test_polytope_of_a_cube_is_the_cube_at_its_corners() -> None:
    views = rig(4)
    seen, _ = _cube_views(4)
    vertices = tangent_polytope(seen, pose_set(views), np.zeros(3))
    for corner in CUBE:
        assert np.linalg.norm(vertices - corner, axis=1).min() < 2e-6
    assert np.all(ConvexHull(vertices).volume >= ConvexHull(CUBE).volume * (1.0 - 1e-4))


def test_polytope_casts_the_outlines_it_was_made_from() -> None:
    views = rig(4)
    seen, rings = _cube_views(4)
    vertices = tangent_polytope(seen, pose_set(views), np.full(3, 1e-4))
    for view, ring in zip(views, rings, strict=True):
        cast = view.intrinsics.project(vertices @ view.R_cam_particle.T + view.t_cam_particle)
        assert np.ptp(cast, axis=0) == pytest.approx(np.ptp(ring, axis=0), abs=0.05)


def test_polytope_holds_a_smooth_body_within_the_views_resolution() -> None:
    semi_axes = np.array([2e-3, 3e-3, 4e-3])
    views = ellipsoid_views(semi_axes, rig(6))
    vertices = tangent_polytope(views.silhouettes, views.poses, np.zeros(3))
    reach = vertices.max(axis=0)
    assert np.all(reach > semi_axes * (1.0 - 1e-3))
    assert np.all(reach < semi_axes * 1.2)


def test_a_middle_outside_the_body_is_refused() -> None:
    seen, _ = _cube_views(4)
    with pytest.raises(InputError, match="tangent planes"):
        tangent_polytope(seen, pose_set(rig(4)), np.array([5e-3, 0.0, 0.0]))
