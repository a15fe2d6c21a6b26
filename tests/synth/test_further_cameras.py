"""Further high-speed cameras film the same flight from where the recipe says, when their hidden clock says, and change nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.recipes.recipe import EffectRecipe, FurtherHsvRecipe, HsvRecipe, MotionRecipe, NoiseRecipe, Recipe, RigRecipe
from datasets.vocabulary.outline import signed_area
from synth.further_cameras import placed
from synth.high_speed_camera import hsv_camera
from synth.sequence import build_silhouette_campaign, build_silhouette_sequence, plan_sequence

SLOW = MotionRecipe(frames=6, speed_ms=(0.5, 1.0), spin_rads=(50.0, 100.0))
ALONE = Recipe(seed=3, motion=SLOW, rig=RigRecipe(drops=1))
SIDE = FurtherHsvRecipe(delay_frames=0.25, hidden_offset_frames=(0.5, 0.5), hidden_rate=(1e-3, 1e-3), offset_sigma_frames=0.6)
TWO = replace(ALONE, further_hsv=(SIDE,))


@pytest.mark.parametrize("angle_deg", [10.0, 45.0, 90.0, 170.0])
@pytest.mark.parametrize("around_deg", [0.0, 90.0, 200.0])
def test_a_camera_stands_where_the_recipe_says(angle_deg: float, around_deg: float) -> None:
    camera = placed(hsv_camera(HsvRecipe()), FurtherHsvRecipe(angle_deg, around_deg), 0.6, 0.4, name="side")
    assert camera.R_cam_world[2, 2] == pytest.approx(np.cos(np.deg2rad(angle_deg)))
    assert camera.R_cam_world @ [0.0, 0.0, 0.6] + camera.t_cam_world == pytest.approx([0.0, 0.0, 0.4])
    stands = -camera.R_cam_world.T @ camera.t_cam_world - [0.0, 0.0, 0.6]
    aside = [np.cos(np.deg2rad(around_deg)), np.sin(np.deg2rad(around_deg))]
    assert stands[:2] == pytest.approx(0.4 * np.sin(np.deg2rad(angle_deg)) * np.array(aside), abs=1e-12)


def test_the_first_camera_films_what_it_did() -> None:
    alone, two = (build_silhouette_sequence(recipe, 0) for recipe in (ALONE, TWO))
    for one, other in zip(alone[0].recordings[0], two[0].recordings[0], strict=True):
        assert one.points_px == pytest.approx(other.points_px, abs=1e-6)


def test_frames_are_taken_when_the_hidden_clock_says() -> None:
    plan, stamps_s = plan_sequence(TWO, 0), np.arange(6) / 4000.0
    side = plan.further[0]
    assert side.clock.times_s == pytest.approx(stamps_s + 0.25 / 4000.0)
    assert side.clock.offset_sigma_s == pytest.approx(0.6 / 4000.0)
    assert side.true_times_s == pytest.approx((1.0 + 1e-3) * stamps_s + 0.75 / 4000.0)
    assert side.motion.x_world == pytest.approx(plan.flight.at(side.true_times_s).x_world)


def test_both_cameras_see_the_particle_at_one_place() -> None:
    """In step, the lines of sight to the middles of two outlines meet, but for perspective and shape."""
    in_step = replace(TWO, further_hsv=(FurtherHsvRecipe(focal_mm=80.0, distance_m=0.5),), noise=NoiseRecipe(hsv_boundary_px=0.0))
    observation, truth = build_silhouette_sequence(in_step, 0)
    for frame, x in enumerate(truth.motion.x_world):
        for camera, recording in zip(observation.cameras, observation.recordings, strict=True):
            points = recording[frame].points_px  # type: ignore[index]
            assert signed_area(points) > 0
            middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
            shown = camera.intrinsics.project((camera.R_cam_world @ x + camera.t_cam_world)[None])[0]
            assert middle == pytest.approx(shown, abs=0.1 * np.ptp(points, axis=0).max())


def test_truth_says_what_is_hidden_and_the_observation_does_not() -> None:
    observation, truth = build_silhouette_sequence(TWO, 0)
    note = truth.notes["further_cameras"][0]
    assert (note["name"], note["clock_rate"]) == (observation.cameras[1].name, pytest.approx(1e-3))
    assert note["clock_offset_s"] == pytest.approx(0.5 / 4000.0)
    assert observation.clock_of(1).times_s[0] == pytest.approx(0.25 / 4000.0)


def test_offsets_of_a_range_are_drawn_for_every_sequence() -> None:
    drawn = replace(ALONE, sequences=4, further_hsv=(replace(SIDE, hidden_offset_frames=(-0.5, 0.5)),))
    offsets = [plan_sequence(drawn, index).further[0].clock_error[0] * 4000.0 for index in range(4)]
    assert np.ptp(offsets) > 0.1
    assert np.abs(offsets).max() <= 0.5


def test_an_effect_of_one_camera_is_in_no_other() -> None:
    wrong = replace(TWO, effects=(EffectRecipe("focal_length", {"relative": 0.1}, camera=1),))
    plan = plan_sequence(wrong, 0)
    stated, side = plan.hsv.intrinsics, plan.further[0]
    assert plan.true_camera == stated
    assert side.true_camera.fx_px == pytest.approx(1.1 * side.hsv.intrinsics.fx_px)


def test_a_campaign_is_made_of_the_same_sequences() -> None:
    campaign = replace(TWO, sequences=2, same_particle=True)
    together = build_silhouette_campaign(campaign)[1][0]
    alone = build_silhouette_sequence(campaign, 1)[0]
    for one, other in zip(together.recordings[1], alone.recordings[1], strict=True):
        assert np.array_equal(one.points_px, other.points_px)
