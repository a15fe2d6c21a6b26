"""Where an outline moves when the body does, against outlines of the body a little moved."""

import numpy as np
import pytest
import shapely
from scipy.spatial.transform import Rotation

from datasets.vocabulary.camera import Intrinsics
from synth.particles.family import procedural
from synth.silhouette import exact_outline, outline_mesh
from synth.silhouette.contour_points import contour_points
from synth.silhouette.noisy_outline import samples_with_normals

STEP = 1e-7
"""Metres, or radians times the body's size: small against the facets, whose corners a sample must not pass."""
REACH_PX = 0.05


@pytest.mark.parametrize("family", ["cut_stone", "jagged"])
@pytest.mark.parametrize("distortion", [(0.0,) * 5, (-0.3, 0.2, 2e-3, -1e-3, 0.1)], ids=["no lens", "a lens"])
def test_outlines_move_as_points_fixed_to_the_body(family: str, distortion: tuple[float, float, float, float, float]) -> None:
    shape = procedural(family, 0.5, np.random.default_rng(7))
    size = 6e-3 / shape.extents.max()
    mesh = outline_mesh(shape.vertices * size, np.asarray(shape.faces))
    camera = Intrinsics(1024, 1024, 6000.0, 6100.0, 500.0, 520.0, distortion)
    R, t = Rotation.from_rotvec([0.3, 1.1, -0.7]).as_matrix(), np.array([0.02, -0.03, 0.6])
    samples, outward = samples_with_normals(exact_outline(mesh, camera, R, t), spacing_px=1.0, phase=0.5)
    seen = contour_points(mesh, camera, mesh.vertices @ R.T + t, samples, outward)
    assert camera.project(seen.points_cam) == pytest.approx(samples, abs=1e-6)
    by_turn = np.cross(seen.points_cam - t, seen.move_by_point)
    lines = shapely.linestrings(np.stack([samples - REACH_PX * outward, samples + REACH_PX * outward], axis=1))
    for k in range(3):
        shift, turn = STEP * np.eye(3)[k], Rotation.from_rotvec(STEP / 3e-3 * np.eye(3)[k]).as_matrix()
        for moved, expected in (((R, t + shift), STEP * seen.move_by_point[:, k]), ((turn @ R, t), STEP / 3e-3 * by_turn[:, k])):
            met = shapely.intersection(lines, shapely.linearrings(exact_outline(mesh, camera, *moved)))
            one = shapely.get_type_id(met) == 0
            move = np.sum((shapely.get_coordinates(met[one]) - samples[one]) * outward[one], axis=1)
            off = np.abs(move - expected[one]) > 2e-3 * np.abs(expected).max()
            assert one.mean() > 0.95
            assert off.mean() < 0.02  # beside a corner the line meets another facet
