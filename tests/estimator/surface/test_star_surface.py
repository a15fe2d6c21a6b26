"""Where rays leave the cones of outlines: beside a brute search along the rays, and exactly for one view."""

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np

from datasets.observation import CalibratedView
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.geometry.visual_hull import bounding_ball
from estimator.motion.rotation import rotation_from_vector
from estimator.surface.contact import Picture, contacts_of
from estimator.surface.star_surface import _left_at, sphere, star_surface

DISTORTION = (0.1, -0.2, 1e-3, 2e-3, 0.0)
CAMERA = Intrinsics(width_px=640, height_px=480, fx_px=4000.0, fy_px=4100.0, cx_px=310.5, cy_px=245.5, distortion=DISTORTION)
CENTRE = np.array([2e-4, -1e-4, 3e-4])


def blob(angle: float) -> Outline:
    """An outline with a hollow, around the picture's middle."""
    phi = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)
    r = 60.0 + 22.0 * np.cos(2 * phi + angle) + 6.0 * np.sin(5 * phi)
    return Outline(np.array([320.0, 240.0]) + r[:, None] * np.column_stack([np.cos(phi), np.sin(phi)]))


def view(turn: list[float]) -> CalibratedView:
    return CalibratedView(CAMERA, rotation_from_vector(np.array(turn)), np.array([0.0, 0.0, 0.4]))


def test_rays_end_on_the_outline_and_are_within_it_before() -> None:
    outline, seen, directions = blob(0.3), view([0.2, -0.5, 1.0]), sphere(3).directions
    reach = _left_at(outline, seen, CENTRE, directions)
    assert np.isfinite(reach).mean() > 0.97, "only rays nearly along the line of sight never leave"
    out = np.isfinite(reach) & (reach < 0.05)
    polygon = outline.points_px.astype(np.float32)
    for share, expected in ((0.5, 1.0), (0.98, 1.0), (1.02, -1.0)):
        points = CENTRE + share * reach[out, None] * directions[out]
        pixels = CAMERA.project(points @ seen.R_cam_particle.T + seen.t_cam_particle).astype(np.float32)
        side = np.array([cv2.pointPolygonTest(polygon, (float(x), float(y)), False) for x, y in pixels])
        assert np.mean(side == expected) > 0.995
    ends = CENTRE + reach[out, None] * directions[out]
    pixels = CAMERA.project(ends @ seen.R_cam_particle.T + seen.t_cam_particle).astype(np.float32)
    off = np.array([cv2.pointPolygonTest(polygon, (float(x), float(y)), True) for x, y in pixels])
    assert np.abs(off).max() < 0.02


def test_a_direction_that_hardly_leaves_a_cone_ends_with_the_ball() -> None:
    """Three views from nearly one side: rays along their lines of sight leave the cones far behind the body, or never."""
    views = tuple(view([0.03 * k, 0.02 * k, 0.0]) for k in range(3))
    outlines = (blob(0.0),) * 3
    particle: Any = SimpleNamespace(outlines=outlines, calibrated=views, body=SimpleNamespace(com_particle=CENTRE))
    reach = np.linalg.norm(star_surface(particle, subdivisions=3).vertices - CENTRE, axis=1)
    _, radius = bounding_ball(outlines, views)
    assert np.isfinite(reach).all()
    np.testing.assert_allclose(reach.max(), 2.0 * radius)


def test_rounding_changes_no_edge_that_samples_of_a_hull_meet() -> None:
    """Many of its faces lie in the cones that carved it: they are seen edge-on, and rounding must not say which way they are turned."""
    views = tuple(view([0.9 * k, 0.5 * k, 0.3]) for k in range(4))
    outlines = tuple(Outline(blob(0.4 * k).points_px[::8]) for k in range(4))
    particle: Any = SimpleNamespace(outlines=outlines, calibrated=views, body=SimpleNamespace(com_particle=CENTRE))
    hull = star_surface(particle, subdivisions=5)
    pictures = [Picture(v.intrinsics, v.R_cam_particle, v.t_cam_particle, o.points_px) for v, o in zip(views, outlines, strict=True)]
    rounding = 1e-14 * np.random.default_rng(3).standard_normal(hull.vertices.shape)
    met, again = contacts_of(hull, pictures), contacts_of(hull.moved(rounding), pictures)
    np.testing.assert_array_equal(again.first, met.first)
    np.testing.assert_array_equal(again.second, met.second)
    np.testing.assert_allclose(again.gap_px, met.gap_px, atol=1e-6)
