"""Outlines that meshes cast: convex ones exactly, hollows between spikes, and none that a rough surface only suggests."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import shapely
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.cast_outline import SHALLOW_PX, _draw, _traced, cast_outline, casting_mesh, with_hollows_seen
from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.outline_shape import outline_shape

Array = NDArray[np.float64]
CAMERA = Intrinsics(width_px=400, height_px=400, fx_px=5000.0, fy_px=5000.0, cx_px=200.0, cy_px=200.0)
DEPTH = np.array([0.0, 0.0, 0.5])


def cast(mesh: trimesh.Trimesh) -> shapely.Polygon:
    return shapely.Polygon(
        cast_outline(casting_mesh(SurfaceMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))), CAMERA, np.eye(3), DEPTH)
    )


def plate(ring: list[tuple[float, float]]) -> trimesh.Trimesh:
    """A thin prism over a ring that its first point sees all of."""
    n = len(ring)
    flat = np.array(ring)
    vertices = np.vstack([np.column_stack([flat, np.full(n, z)]) for z in (0.0, 1e-6)])
    faces = [(0, i + 1, i) for i in range(1, n - 1)] + [(n, n + i, n + i + 1) for i in range(1, n - 1)]
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, n + j), (i, n + j, n + i)]
    return trimesh.Trimesh(vertices, np.array(faces), process=False)


def test_a_convex_body_casts_the_hull_of_its_corners() -> None:
    box = trimesh.creation.box(extents=(6e-3, 4e-3, 1e-6))
    seen = cast(box)
    assert seen.area == pytest.approx(60.0 * 40.0, rel=1e-3)
    assert shapely.hausdorff_distance(seen, shapely.box(170, 180, 230, 220)) < 0.01


def test_a_notch_is_cut_out_and_a_scratch_is_not() -> None:
    for depth_m, is_hollow in ((1e-3, True), (0.5 * SHALLOW_PX * 1e-4, False)):
        ring = [
            (0.0, -2e-3),
            (3e-3, -2e-3),
            (3e-3, 2e-3),
            (1e-3, 2e-3),
            (0.0, 2e-3 - depth_m),
            (-1e-3, 2e-3),
            (-3e-3, 2e-3),
            (-3e-3, -2e-3),
        ]
        seen = cast(plate(ring))
        missing = 60.0 * 40.0 - seen.area
        expected = 0.5 * 20.0 * depth_m / 1e-4 if is_hollow else 0.0
        assert missing == pytest.approx(expected, abs=2.5)


def test_lines_are_drawn_as_opencv_draws_them() -> None:
    rng = np.random.default_rng(0)
    short = rng.integers(4, 96, (400, 1, 2)) + rng.integers(-4, 5, (400, 2, 2))
    for lines in (short, rng.integers(0, 100, (40, 2, 2))):
        here, theirs = np.zeros((2, 100, 100), np.uint8)
        _draw(here, lines, np.full(len(lines), 255, dtype=np.uint8))
        cv2.polylines(theirs, lines.astype(np.int32), isClosed=False, color=255)
        np.testing.assert_array_equal(here, theirs)


def test_the_corners_of_a_convex_outline_are_found_on_the_rim_alone() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=4e-3)
    mesh = casting_mesh(SurfaceMesh(np.asarray(ball.vertices), np.asarray(ball.faces)))
    rim_alone = cast_outline(mesh, CAMERA, np.eye(3), DEPTH)
    everything = cast_outline(replace(mesh, ends=mesh.ends[:-1], beside=mesh.beside[:-1]), CAMERA, np.eye(3), DEPTH)
    np.testing.assert_array_equal(rim_alone, everything)


def star(points: int = 5, *, outer: float = 40.0, inner: float = 14.0) -> Array:
    """A star (2 points, 2) px, spikes as bodies with hollows have them."""
    angle = np.pi * np.arange(2 * points) / points
    return np.where(np.arange(2 * points) % 2 == 0, outer, inner)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def filled(outline: Array) -> Array:
    """What a hull makes of it that no view looks into."""
    return np.asarray(outline[ConvexHull(outline).vertices])


def reach(outline: Array) -> Array:
    return np.asarray((outline @ unit_circle(90).T).max(axis=0))


@pytest.mark.parametrize("offset", [0.0, -0.6], ids=["as it is", "drawn too tight"])
@pytest.mark.parametrize("shift", [0.0, 2.5], ids=["in place", "off"])
def test_hollows_that_are_seen_are_cut_out_and_no_corner_is_touched(offset: float, shift: float) -> None:
    seen = shapely.get_coordinates(shapely.Polygon(star()).buffer(offset, join_style="mitre", mitre_limit=20.0).exterior)[:-1]
    cut = with_hollows_seen(filled(star()), seen + np.array([shift, 0.0]))
    np.testing.assert_allclose(reach(cut), reach(star()), atol=1e-9)
    hollow, known = (shapely.Polygon(filled(star())).area - shapely.Polygon(each).area for each in (cut, star()))
    assert hollow > (0.9 if offset == shift == 0.0 else 0.5) * known
    assert shapely.Polygon(star()).difference(shapely.Polygon(cut)).area < 0.01 * known


def test_a_tip_at_which_a_seen_outline_crosses_itself_is_not_cut_off() -> None:
    """Noise crosses the sides of thin spikes; the lobe beyond turns the other way round."""
    crossed = np.concatenate([[[34.0, 1.0], [40.0, 0.0], [34.0, -1.0]], star()[1:]])
    cut = with_hollows_seen(filled(star()), crossed)
    np.testing.assert_allclose(reach(cut), reach(star()), atol=1e-9)


def test_corners_between_hollows_that_are_seen_recede_as_they_do() -> None:
    """A spike of 32 degrees recedes by 3.6 times the depth; the corner that a hull makes of it, a pentagon, by 1.2 times."""
    cut = with_hollows_seen(filled(star()), star())
    true, hull, seen = (outline_shape([each]).erosion[0, 0, 1] for each in (star(), filled(star()), cut))
    assert hull < 0.5 * true
    assert seen == pytest.approx(true, rel=0.15)


def test_an_outline_elsewhere_cuts_nothing() -> None:
    left = with_hollows_seen(filled(star()), 0.2 * star() + 300.0)
    assert shapely.Polygon(left).area == pytest.approx(shapely.Polygon(filled(star())).area, rel=1e-3)


@pytest.mark.parametrize("seed", range(20))
def test_the_border_of_a_drawing_is_the_one_that_opencv_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    picture = np.zeros((60, 70), dtype=np.int32)
    corners = np.cumsum(rng.integers(-9, 10, size=(1 + seed, 2)), axis=0) % 50 + 5
    lines = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    _draw(picture, lines, np.arange(1, len(lines) + 1, dtype=np.int32))
    (known,), _ = cv2.findContours((picture > 0).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    np.testing.assert_array_equal(_traced(picture, int(corners[:, 1].min())), known[:, 0])
