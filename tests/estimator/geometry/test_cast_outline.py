"""Outlines that meshes cast: convex ones exactly, hollows between spikes, and none that a rough surface only suggests."""

import numpy as np
import pytest
import shapely
import trimesh

from datasets.vocabulary.camera import Intrinsics
from estimator.geometry.cast_outline import SHALLOW_PX, cast_outline, casting_mesh
from estimator.geometry.visual_hull import HullMesh

CAMERA = Intrinsics(width_px=400, height_px=400, fx_px=5000.0, fy_px=5000.0, cx_px=200.0, cy_px=200.0)
DEPTH = np.array([0.0, 0.0, 0.5])


def cast(mesh: trimesh.Trimesh) -> shapely.Polygon:
    return shapely.Polygon(
        cast_outline(casting_mesh(HullMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))), CAMERA, np.eye(3), DEPTH)
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
