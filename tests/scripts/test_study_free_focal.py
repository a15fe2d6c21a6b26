"""The study of a free focal length: what misleads, and how rows become medians."""

import numpy as np
import pytest

from datasets.recipes.recipe import MotionRecipe, Recipe, RigRecipe
from scripts.trials.study_free_focal import STATED_OVER_TRUE, misled, summary
from synth.sequence import build_silhouette_sequence


def test_only_the_stated_focal_length_is_wrong() -> None:
    observation, _ = build_silhouette_sequence(Recipe(motion=MotionRecipe(frames=5), rig=RigRecipe(drops=1)), 0)
    told = misled(observation)
    given, wrong = observation.cameras[0].intrinsics, told.cameras[0].intrinsics
    assert wrong.fx_px / given.fx_px == wrong.fy_px / given.fy_px == pytest.approx(STATED_OVER_TRUE)
    assert (wrong.cx_px, wrong.cy_px) == (given.cx_px, given.cy_px)
    assert told.recordings is observation.recordings


def test_summary_counts_what_did_not_converge_and_takes_medians_of_sizes() -> None:
    rows = [
        {"status": "converged", "in_plane_percent": 1.0, "focal_error_percent": -3.0, "focal_pull": -3.0},
        {"status": "converged", "in_plane_percent": 3.0, "focal_error_percent": 1.0, "focal_pull": 4.0},
        {"status": "no convergence"},
    ]
    told = summary(rows)
    assert (told["sequences"], told["converged"]) == (3, 2)
    assert told["in_plane_percent"] == 2.0
    assert told["focal_error_percent"] == 2.0
    assert told["focal_pull_rms"] == pytest.approx(np.sqrt(12.5))
