"""The rig resembles the real one, and every view sees the whole particle."""

import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.recipes.recipe import RigRecipe
from datasets.vocabulary.frames import is_rotation
from synth.rig import AXES, rig_views, stated_views

COM = np.array([1e-3, -0.5e-3, 2e-3])
VIEWS = rig_views(RigRecipe(), COM, np.random.default_rng(5))


def axes_apart_deg(directions: np.ndarray) -> list[float]:
    return [float(np.degrees(np.arccos(a @ b))) for a, b in combinations(directions, 2)]


def test_nominal_axes_are_icosahedral() -> None:
    np.testing.assert_allclose(np.minimum(axes_apart_deg(AXES), 180 - np.array(axes_apart_deg(AXES))), 63.4349488, atol=1e-6)


def test_sixty_views_of_six_cameras_and_ten_drops() -> None:
    assert [(v.drop, v.camera) for v in VIEWS] == [(d, c) for d in range(10) for c in range(6)]
    assert all(is_rotation(v.R_cam_particle) for v in VIEWS)
    assert len({v.intrinsics.fx_px for v in VIEWS}) == 6
    assert all(65000 <= v.intrinsics.fx_px <= 88000 for v in VIEWS)


def test_scale_and_place_of_the_particle() -> None:
    for view in VIEWS:
        centre = view.R_cam_particle @ COM + view.t_cam_particle
        assert 1e3 * centre[2] / view.intrinsics.fx_px == pytest.approx(0.017, rel=0.003)
        off = view.intrinsics.project(centre[None])[0] - [511.5, 383.5]
        # Six standard deviations of pointing and place together.
        assert np.abs(off).max() < 6 * np.hypot(0.5, 0.5) / 0.017


def test_cameras_stay_and_the_particle_moves_between_drops() -> None:
    first, second = (VIEWS[6 * drop].R_cam_particle for drop in (0, 1))
    assert np.abs(first - second).max() > 0.1
    relative = [VIEWS[6 * d + 1].R_cam_particle @ VIEWS[6 * d].R_cam_particle.T for d in range(10)]
    np.testing.assert_allclose(relative, np.tile(relative[0], (10, 1, 1)), atol=1e-12)


def test_stated_poses_are_off_by_as_much_as_is_asked_for() -> None:
    """In the picture and, by turns about three axes, at the rim, in the views' pixels."""
    many = RigRecipe(drops=100, calibration_px=0.7)
    views = rig_views(many, COM, np.random.default_rng(6))
    corners = COM + 2e-3 * np.array([[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]])  # a particle of 4 mm
    stated = stated_views(many, views, corners, np.random.default_rng(7))
    px_per_m = np.array([v.intrinsics.fx_px / (v.R_cam_particle @ COM + v.t_cam_particle)[2] for v in views])
    moved = [(s.R_cam_particle - v.R_cam_particle) @ COM + s.t_cam_particle - v.t_cam_particle for s, v in zip(stated, views, strict=True)]
    turned = [(Rotation.from_matrix(s.R_cam_particle @ v.R_cam_particle.T)).as_rotvec() for s, v in zip(stated, views, strict=True)]
    assert np.std(px_per_m[:, None] * np.array(moved)[:, :2], axis=0) == pytest.approx(np.full(2, 0.7), rel=0.1)
    assert np.abs(np.array(moved)[:, 2]).max() < 1e-12
    assert np.std(px_per_m[:, None] * 2e-3 * np.array(turned), axis=0) == pytest.approx(np.full(3, 0.7), rel=0.1)


def test_a_calibration_that_is_right_says_where_views_are() -> None:
    assert stated_views(RigRecipe(), VIEWS, np.eye(3), np.random.default_rng(8)) is VIEWS


def test_the_real_rig_has_the_same_geometry(shared_data: Path) -> None:
    cameras = json.loads((shared_data / "silhouettes" / "uct_stone6" / "cameras.json").read_text())
    real = np.array([camera["pose_world_to_cam"] for camera in cameras])
    ours = np.array([v.R_cam_particle[2] for v in VIEWS[:6]])
    for directions in (real[:, 2, :3], ours):
        folded = [min(angle, 180 - angle) for angle in axes_apart_deg(directions)]
        assert max(abs(angle - 63.43) for angle in folded) < 4
    per_px = [camera["pose_world_to_cam"][2][3] / camera["efl"] for camera in cameras]
    assert np.mean(per_px) == pytest.approx(RigRecipe().mm_per_px, rel=0.05)
