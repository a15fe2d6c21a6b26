"""Several high-speed cameras in the rendered tier: pictures of each show the particle where it is when that camera exposes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from datasets.observation import Frames
from datasets.observation_files import read_observation
from datasets.recipes.recipe import FurtherHsvRecipe, RigRecipe
from synth.frame_outlines import frame_outlines
from synth.rendering.sequence import render_sequence
from synth.rendering.shots import frame_shots
from synth.sequence import plan_sequence
from synth.silhouette import outline_mesh
from tests.synth.rendering.test_sequence import RECIPE

TWO = replace(
    RECIPE,
    rig=RigRecipe(drops=1, rendered=False),
    further_hsv=(
        FurtherHsvRecipe(focal_mm=80.0, width_px=112, exposure_us=20.0, hidden_offset_frames=(0.5, 0.5), offset_sigma_frames=0.5),
    ),
)


def test_pictures_of_each_camera_are_those_of_its_own_times(tmp_path: Path) -> None:
    name = render_sequence(TWO, 0, tmp_path)
    observation, plan = read_observation(tmp_path / "observations" / name), plan_sequence(TWO, 0)
    assert [camera.name for camera in observation.cameras] == ["hsv", "hsv_2"]
    for each, recording in zip(plan.by_camera, observation.recordings, strict=True):
        assert isinstance(recording, Frames)
        background = recording.background()
        assert background is not None
        assert background.shape == (each.hsv.intrinsics.height_px, each.hsv.intrinsics.width_px)
        for k, outline in enumerate(frame_outlines(each, outline_mesh(each.vertices, each.faces))):
            dark, polygon = recording.read(k) < 0.5 * background, shapely.Polygon(outline)
            middle = np.argwhere(dark).mean(axis=0)[::-1]
            assert dark.sum() == pytest.approx(polygon.area, rel=0.02)
            assert middle == pytest.approx(np.array(polygon.centroid.coords)[0], abs=0.1)


def test_shots_of_the_first_camera_are_what_they_were() -> None:
    alone = replace(TWO, further_hsv=())
    shots = [next(iter(frame_shots(plan_sequence(recipe, 0), recipe, 0))) for recipe in (alone, TWO)]
    assert shots[0].seeds == shots[1].seeds
    assert shots[0].further == ""
    other = next(iter(frame_shots(plan_sequence(TWO, 0).further[0], TWO, 0, camera=1)))
    assert other.further == "-hsv_2"
    assert other.seeds != shots[0].seeds
