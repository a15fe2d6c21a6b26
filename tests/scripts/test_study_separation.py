"""The study of advice on further data: one case whole, and how rows become a page."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from datasets.recipes.recipe import EffectRecipe, HsvRecipe
from scripts.trials.study_separation import CASES, FARTHER, MADE, SEED, page, recording, run_case, second_camera, summary
from synth.high_speed_camera import hsv_camera

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def scales() -> dict[str, Any]:
    """Frame rate or length scale: what is said of a second camera and of more of the same, and what comes of both."""
    small = replace(CASES[0], hidden=EffectRecipe("frame_rate", {"relative": 0.06}), frames=40)
    return run_case(small, SEED, ("another", "second_camera"))


def test_the_pair_is_one_group_and_what_is_advised_tells_it_apart(scales: dict[str, Any]) -> None:
    assert scales["left_out"] == []
    assert scales["group"]
    assert scales["p"] < 0.01
    made = {r["key"]: r for r in scales["recordings"]}
    assert made["second_camera"]["probability"] > 0.95
    assert made["second_camera"]["told_apart"]
    assert made["another"]["probability"] < 0.05
    assert not made["another"]["told_apart"]


def test_recordings_are_changed_in_what_their_name_says() -> None:
    recipe = CASES[1].recipe(3)
    usual, longer, faster = (MADE[key](recipe, 0) for key in ("another", "longer", "faster"))
    assert len(longer.clock.times_s) == 2 * len(usual.clock.times_s)
    speeds = [np.linalg.norm(plan.motion.v_world[30]) for plan in (usual, faster)]
    assert speeds[1] > 1.5 * speeds[0]
    nearer = MADE["nearer"](recipe, 0)
    assert nearer.hsv.intrinsics == usual.hsv.intrinsics
    assert np.median(nearer.motion.x_world[:, 2]) < 0.6 * np.median(usual.motion.x_world[:, 2])
    both = recording(recipe, 0, "second_camera")
    assert [len(r) for r in both.recordings] == [60, 60]
    assert all(len(outline.points_px) for r in both.recordings for outline in r)


def test_the_second_camera_looks_at_the_stage_from_the_side() -> None:
    first = hsv_camera(HsvRecipe())
    stage = np.array([0.0, 0.0, 0.6])
    second = second_camera(first, stage)
    assert second.R_cam_world @ stage + second.t_cam_world == pytest.approx(FARTHER * stage, abs=1e-12)
    assert second.R_cam_world[2] @ first.R_cam_world[2] == pytest.approx(0.0, abs=1e-12)


def row(key: str, probability: float, *, told_apart: bool) -> dict[str, Any]:
    return {"key": key, "drops": 2, "predicted": 10.0, "probability": probability, "measured": 12.0, "told_apart": told_apart}


def test_the_page_counts_advice_that_held_and_advice_that_did_not() -> None:
    rows = [
        {"case": "a", "seed": 1, "recordings": [row("faster", 0.99, told_apart=True), row("another", 0.0, told_apart=True)]},
        {"case": "a", "seed": 2, "recordings": [row("faster", 0.96, told_apart=False), row("another", 0.5, told_apart=False)]},
        {"case": "a", "seed": 3, "recordings": []},
    ]
    another, faster = summary(rows)
    assert (faster["key"], faster["advised"], faster["advised_told_apart"], faster["refused"]) == ("faster", 2, 1, 0)
    assert (another["advised"], another["refused"], another["refused_told_apart"]) == (0, 1, 1)
    text = page(rows)
    assert "Of 3 campaigns with one effect hidden, 2 had the pair in one group; 4 recordings were made for those." in text
    assert "Of the 1 in between, 0 told it apart" in text
    assert "**2 were said to tell the pair apart" in text
    assert "| a | a drop twice as fast | 2.0 | 10.0 | 12.0 | 1 of 2 | – |" in text
