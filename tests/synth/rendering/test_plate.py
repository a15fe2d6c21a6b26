"""The plate in rendered pictures: it stands in the background, hides what lies behind it, mirrors the particle; masks end at it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from datasets.observation_files import read_observation
from datasets.recipes.recipe import DropperRecipe, HsvRecipe, PlateRecipe, Recipe, RenderingRecipe, RigRecipe
from datasets.truth_files import read_truth
from synth.frame_outlines import frame_outlines
from synth.rendering.sequence import render_sequence
from synth.sequence import plan_sequence
from synth.silhouette import outline_mesh

RECIPE = Recipe(
    seed=11,
    tier="rendered",
    plate=PlateRecipe(elevation_deg=3.0),
    dropper=DropperRecipe(runs=2, frames_before=(5, 5), frames_after=(3, 3)),
    rig=RigRecipe(drops=1, rendered=False),
    hsv=HsvRecipe(width_px=256, height_px=256, focal_mm=45.0, exposure_us=10.0, f_number=200.0),
    rendering=RenderingRecipe(variant="scalar_rgb", subframes=2, samples_per_subframe=4),
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("rendered")
    name = render_sequence(RECIPE, 0, out)
    return read_observation(out / "observations" / name), read_truth(out / "truth" / name), plan_sequence(RECIPE, 0)


def filled(outline: np.ndarray) -> np.ndarray:
    picture = np.zeros((256, 256), dtype=np.uint8)
    cv2.fillPoly(picture, [np.rint(outline * 16).astype(np.int32)], 1, shift=4)
    return picture.astype(bool)


def test_the_plate_stands_dark_in_the_background(made) -> None:
    observation, _, _ = made
    plate = cv2.erode(filled(observation.plate_outlines[0].points_px).astype(np.uint8), np.ones((5, 5))).astype(bool)
    beside = ~cv2.dilate(filled(observation.plate_outlines[0].points_px).astype(np.uint8), np.ones((5, 5))).astype(bool)
    background = observation.recordings[0].background()
    assert np.median(background[plate]) < 0.2 * np.median(background[beside])
    assert background[beside].min() > 0.5 * np.median(background[beside])


def test_masks_are_the_silhouettes_beside_the_plate(made) -> None:
    _, truth, plan = made
    for number, outline in enumerate(frame_outlines(plan, outline_mesh(plan.vertices, plan.faces))):
        mask, expected = truth.masks.read(number).astype(bool), filled(outline)
        assert expected.sum() > 50
        assert (mask ^ expected).sum() < 0.15 * expected.sum(), number


def test_frames_differ_from_the_background_only_near_the_particle(made) -> None:
    observation, truth, _ = made
    background = observation.recordings[0].background().astype(float)
    for number in range(len(observation.recordings[0])):
        changed = np.abs(observation.recordings[0].read(number) - background) > 400
        near = cv2.dilate(truth.masks.read(number).astype(np.uint8), np.ones((25, 25))).astype(bool)
        assert changed[near].any()
        assert not changed[~near].any()


def test_a_particle_above_the_plate_darkens_its_mirror(made) -> None:
    """Where the strip of the surface that mirrors the panel is seen, the particle's mirror image and shadow lie just below it."""
    observation, truth, _ = made
    first = int(np.sum(observation.clock.times_s < truth.impacts[0].time_s)) - 1
    plate = filled(observation.plate_outlines[0].points_px)
    under = cv2.dilate(truth.masks.read(first).astype(np.uint8), np.ones((7, 7))).astype(bool) & plate
    background = observation.recordings[0].background().astype(float)
    strip = under & (background > background[plate].mean())
    assert strip.sum() > 3
    assert observation.recordings[0].read(first)[strip].mean() < 0.9 * background[strip].mean()


def test_the_silhouette_tier_tells_the_same_story(made) -> None:
    _, truth, _ = made
    other = plan_sequence(replace(RECIPE, tier="silhouette"), 0)
    np.testing.assert_array_equal(truth.impacts[0].v_after, other.impacts[0].v_after)
