"""A sequence is decided by its recipe; its outlines are those of its truth; its streams are independent."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.outline import signed_area
from synth.high_speed_camera import hsv_camera
from synth.plan import particle_poses_in_camera
from synth.sequence import build_silhouette_sequence, plan_sequence
from synth.silhouette import exact_outline, outline_mesh

RECIPE = Recipe(seed=3, motion=MotionRecipe(frames=12), rig=RigRecipe(drops=2))


def points(observation: Observation) -> tuple[np.ndarray, np.ndarray]:
    """All points of the frames and of the views."""
    frames, views = (
        np.vstack([outline.points_px for outline in recording]) for recording in (observation.recordings[0], observation.view_recording)
    )
    return frames, views


def test_the_same_recipe_gives_the_same_bytes() -> None:
    (a, truth_a), (b, truth_b) = (build_silhouette_sequence(RECIPE, 4) for _ in range(2))
    np.testing.assert_array_equal(points(a)[0], points(b)[0])
    np.testing.assert_array_equal(points(a)[1], points(b)[1])
    np.testing.assert_array_equal(truth_a.motion.q_world_body, truth_b.motion.q_world_body)
    np.testing.assert_array_equal(truth_a.mesh_vertices, truth_b.mesh_vertices)


def test_without_effects_a_recipe_gives_what_it_gave_before_there_were_any() -> None:
    """Numbers of the version before effects: the particle's, the rig's, the motion's and both noises' streams are what they were."""
    observation, truth = build_silhouette_sequence(RECIPE, 4)
    np.testing.assert_allclose(observation.recordings[0][11].points_px[7], [543.50997434, 751.10249528], atol=1e-8)
    np.testing.assert_allclose(observation.view_recording[11].points_px[5], [637.94518321, 525.92247264], atol=1e-8)
    np.testing.assert_allclose(truth.motion.q_world_body[11], [0.21677163, -0.17895644, -0.22299825, 0.93341118], atol=1e-8)
    assert truth.effects == {}


def test_seed_and_index_give_other_sequences() -> None:
    first = plan_sequence(RECIPE, 0)
    for other in (plan_sequence(RECIPE, 1), plan_sequence(replace(RECIPE, seed=4), 0)):
        assert not np.array_equal(first.motion.v_world, other.motion.v_world)
        assert not np.array_equal(first.body.com_particle, other.body.com_particle)


def test_changing_one_part_leaves_the_others() -> None:
    base = plan_sequence(RECIPE, 0)
    slower = plan_sequence(replace(RECIPE, motion=replace(RECIPE.motion, frames=8, spin_rads=(1.0, 2.0))), 0)
    np.testing.assert_array_equal(base.vertices, slower.vertices)
    np.testing.assert_array_equal(base.views[3].R_cam_particle, slower.views[3].R_cam_particle)
    fewer = plan_sequence(replace(RECIPE, rig=replace(RECIPE.rig, drops=1)), 0)
    np.testing.assert_array_equal(base.motion.x_world, fewer.motion.x_world)
    np.testing.assert_array_equal(base.views[5].t_cam_particle, fewer.views[5].t_cam_particle)


def test_the_observation_is_that_of_the_truth() -> None:
    exact_recipe = replace(RECIPE, noise=NoiseRecipe(hsv_boundary_px=0.0, rig_boundary_px=0.0))
    observation, truth = build_silhouette_sequence(exact_recipe, 1)
    mesh = outline_mesh(truth.mesh_vertices, truth.mesh_faces)
    R, t = particle_poses_in_camera(truth.body, truth.motion, observation.cameras[0])
    for i, outline in enumerate(observation.recordings[0]):
        exact = shapely.linearrings(exact_outline(mesh, observation.cameras[0].intrinsics, R[i], t[i]))
        assert shapely.distance(exact, shapely.points(outline.points_px)).max() < 1e-9
        assert signed_area(outline.points_px) > 0
    for view, outline in zip(observation.views, observation.view_recording, strict=True):
        exact = shapely.linearrings(exact_outline(mesh, view.intrinsics, view.R_cam_particle, view.t_cam_particle))
        assert shapely.distance(exact, shapely.points(outline.points_px)).max() < 1e-9


def test_outlines_stay_in_their_pictures() -> None:
    for index in range(3):
        observation, _ = build_silhouette_sequence(RECIPE, index)
        frames, views = points(observation)
        assert frames.min() > 0
        assert frames.max() < 1023
        assert views.min() > 0
        assert np.all(views.max(axis=0) < [1023, 767])


def test_the_particle_frame_gives_nothing_away() -> None:
    plan = plan_sequence(RECIPE, 0)
    assert np.linalg.norm(plan.body.com_particle) > 1e-5
    assert np.abs(plan.body.R_particle_body).max(axis=0).min() < 0.999


def test_names_times_and_size() -> None:
    plan = plan_sequence(replace(RECIPE, particle=ParticleRecipe(family="jagged", size_mm=(5.0, 5.0))), 7)
    assert plan.name == "jagged-0007"
    np.testing.assert_allclose(plan.clock.times_s, np.arange(12) / 4000)
    assert plan.descriptors["size_m"] == pytest.approx(5e-3)
    later = plan.flight.at(plan.clock.times_s[-1:] + plan.clock.exposure_s / 2)
    assert np.isfinite(later.q_world_body).all()


def test_the_lens_decides_the_principal_distance() -> None:
    camera = hsv_camera(HsvRecipe(principal_point_offset_px=(3.0, -2.0)))
    # f d / (d - f) = 100 mm * 600 / 500 = 120 mm; 20 µm pixels.
    assert camera.intrinsics.fx_px == pytest.approx(6000)
    assert (camera.intrinsics.cx_px, camera.intrinsics.cy_px) == (514.5, 509.5)


def test_files_take_turns_and_keep_their_size_when_asked(shared_data: Path) -> None:
    files = tuple(str(shared_data / "particles" / name) for name in ("stone_05.ply", "imaged_deimos.ply"))
    plans = [plan_sequence(replace(RECIPE, particle=ParticleRecipe(files=files)), i) for i in range(3)]
    assert [plan.name for plan in plans] == ["stone_05-0000", "imaged_deimos-0001", "stone_05-0002"]
    assert all(4e-3 <= plan.descriptors["size_m"] <= 8e-3 for plan in plans)


def test_a_file_of_implausible_size_is_refused(shared_data: Path) -> None:
    recipe = replace(
        RECIPE, particle=ParticleRecipe(files=(str(shared_data / "particles" / "imaged_deimos.ply"),), unit="m", size_mm=(0.0, 0.0))
    )
    with pytest.raises(InputError, match="looks like millimetres taken for metres"):
        plan_sequence(recipe, 0)


def test_pictures_of_views_are_taken_where_views_are_not_where_their_calibration_says() -> None:
    off, right = (build_silhouette_sequence(replace(RECIPE, rig=replace(RECIPE.rig, calibration_px=px)), 2)[0] for px in (1.0, 0.0))
    np.testing.assert_array_equal(points(off)[0], points(right)[0])
    np.testing.assert_array_equal(points(off)[1], points(right)[1])
    for stated, view in zip(off.views, right.views, strict=True):
        assert stated.intrinsics == view.intrinsics
        assert not np.array_equal(stated.R_cam_particle, view.R_cam_particle)
        assert not np.array_equal(stated.t_cam_particle, view.t_cam_particle)
