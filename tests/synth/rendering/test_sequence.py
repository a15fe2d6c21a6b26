"""The rendered tier on files: complete, true to its truth, and the same after being killed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from datasets.observation import Frames
from datasets.observation_files import read_observation
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RenderingRecipe, RigRecipe
from datasets.truth_files import read_truth
from synth.plan import particle_poses_in_camera
from synth.rendering.parts import parts_of
from synth.rendering.recording import sensor_of
from synth.rendering.sequence import render_sequence
from synth.rendering.shots import frame_shots, hsv_optics, view_shots
from synth.sequence import plan_sequence
from synth.silhouette import exact_outline, outline_mesh

RECIPE = Recipe(
    seed=11,
    tier="rendered",
    particle=ParticleRecipe(size_mm=(4.0, 4.5)),
    motion=MotionRecipe(frames=3, speed_ms=(0.5, 1.0)),
    hsv=HsvRecipe(width_px=128, height_px=112),
    rig=RigRecipe(drops=1, width_px=96, height_px=72, mm_per_px=0.1, focal_px=(13000.0, 15000.0)),
    rendering=RenderingRecipe(variant="scalar_rgb", rig_samples=9, crop_margin_px=4),
)


class KilledError(Exception):
    """Stands for a killed run."""


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    out = tmp_path_factory.mktemp("whole")
    return out, render_sequence(RECIPE, 0, out)


def test_it_is_whole(rendered) -> None:
    out, name = rendered
    observation, truth = read_observation(out / "observations" / name), read_truth(out / "truth" / name)
    frames, views = observation.recordings[0], observation.view_recording
    assert isinstance(frames, Frames)
    assert isinstance(views, Frames)
    assert (len(frames), len(views), len(truth.masks)) == (3, 6, 3)
    assert frames.read(0).shape == (112, 128)
    assert views.read(5).shape == (72, 96)
    assert not np.array_equal(views.background_of(0), views.background_of(1))
    assert truth.notes["variant"] == "scalar_rgb"


def test_masks_and_pictures_are_those_of_the_truth(rendered) -> None:
    out, name = rendered
    observation, truth = read_observation(out / "observations" / name), read_truth(out / "truth" / name)
    camera, frames = observation.cameras[0], observation.recordings[0]
    mesh = outline_mesh(truth.mesh_vertices, truth.mesh_faces)
    R, t = particle_poses_in_camera(truth.body, truth.motion, camera)
    for k in range(3):
        polygon = shapely.Polygon(exact_outline(mesh, camera.intrinsics, R[k], t[k]))
        mask = truth.masks.read(k).astype(bool)
        dark = frames.read(k) < 0.5 * frames.background()
        assert mask.sum() == pytest.approx(polygon.area, rel=0.02)
        np.testing.assert_allclose(np.argwhere(mask).mean(axis=0)[::-1], polygon.centroid.coords[0], atol=0.1)
        assert np.mean(mask == dark) > 0.99


def test_a_killed_run_goes_on_to_the_same_bytes(rendered, tmp_path) -> None:
    out, _ = rendered
    done = []

    def kill_after_four(count: int, total: int) -> None:
        assert total == 9
        if count == 4:
            raise KilledError

    with pytest.raises(KilledError):
        render_sequence(RECIPE, 0, tmp_path, advance=kill_after_four)
    stamps = {path.name: path.stat().st_mtime_ns for path in (tmp_path / ".partial").rglob("*.npz")}
    assert len(stamps) == 4

    def watch(count: int, _total: int) -> None:
        done.append(count)
        for path in (tmp_path / ".partial").rglob("*.npz"):
            assert path.stat().st_mtime_ns == stamps.get(path.name, path.stat().st_mtime_ns)

    render_sequence(RECIPE, 0, tmp_path, advance=watch)
    assert done == list(range(1, 10))
    assert contents(tmp_path) == contents(out)


def test_parts_of_other_settings_are_not_taken(rendered, tmp_path) -> None:
    other = replace(RECIPE, hsv=replace(RECIPE.hsv, f_number=8.0))

    def kill(_done: int, _total: int) -> None:
        raise KilledError

    with pytest.raises(KilledError):
        render_sequence(other, 0, tmp_path, advance=kill)
    render_sequence(RECIPE, 0, tmp_path)
    assert contents(tmp_path) == contents(rendered[0])


def test_views_may_stay_outlines(tmp_path) -> None:
    recipe = replace(RECIPE, rig=replace(RECIPE.rig, rendered=False), motion=replace(RECIPE.motion, frames=1))
    observation = read_observation(tmp_path / "observations" / render_sequence(recipe, 0, tmp_path))
    assert isinstance(observation.recordings[0], Frames)
    assert not isinstance(observation.view_recording, Frames)


def test_shots_do_not_depend_on_each_other() -> None:
    """The third frame of a longer recording of the same flight is the third frame of the shorter one."""
    plan = plan_sequence(RECIPE, 0)
    third = list(frame_shots(plan, RECIPE, 0))[2]
    short = replace(plan, clock=replace(plan.clock, times_s=plan.clock.times_s[2:]))
    assert next(iter(frame_shots(plan, RECIPE, 0))).seeds != third.seeds
    assert next(iter(frame_shots(short, RECIPE, 0))).seeds == next(iter(frame_shots(plan, RECIPE, 0))).seeds
    assert len({shot.seeds for shot in view_shots(plan, RECIPE, 0)}) == 6


def test_the_exposure_lies_about_the_frame_time() -> None:
    plan = plan_sequence(RECIPE, 0)
    R, t = particle_poses_in_camera(plan.body, plan.motion, plan.hsv)
    for k, shot in enumerate(frame_shots(plan, RECIPE, 0)):
        along = np.array([where - t[k] for _, where in shot.poses])
        reach = np.linalg.norm(plan.motion.v_world[k]) * plan.clock.exposure_s / 2
        assert np.linalg.norm(along, axis=1).max() <= 1.001 * reach
        assert np.linalg.norm(along.mean(axis=0)) < 0.2 * reach
        assert np.abs(shot.poses[0][0] - R[k]).max() < 0.01


def test_cameras_keep_their_fixed_pattern_over_sequences() -> None:
    optics = hsv_optics(plan_sequence(RECIPE, 0), RECIPE)
    hsv, again, rig = (sensor_of(optics, RECIPE, camera) for camera in (0, 0, 1))
    light = np.full((112, 128), 0.9)
    np.testing.assert_array_equal(hsv.mean_electrons(light), again.mean_electrons(light))
    assert not np.array_equal(hsv.mean_electrons(light), rig.mean_electrons(light))


def test_parts_belong_to_one_mesh_and_one_flight(tmp_path) -> None:
    plan = plan_sequence(RECIPE, 0)
    larger = replace(plan, vertices=1.01 * plan.vertices)
    elsewhere = replace(plan, motion=replace(plan.motion, x_world=plan.motion.x_world + 1e-6))
    folders = {parts_of(each, {"index": 0}, tmp_path).folder for each in (plan, larger, elsewhere)} | {
        parts_of(plan, {"index": 1}, tmp_path).folder
    }
    assert len(folders) == 4
    assert parts_of(plan, {"index": 0}, tmp_path) == parts_of(plan_sequence(RECIPE, 0), {"index": 0}, tmp_path)
