"""The tasks of studies from a small recipe to rows."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from datasets.recipes.recipe import MotionRecipe, Recipe, RigRecipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from studies.flights.bodies import bodies
from studies.flights.scored import DESCRIBED, SCORED, flight, scored_flight
from studies.plans import figure_4, frame_step, optics, surface_fit, two_cameras
from synth.sequence import build_silhouette_sequence

pytestmark = pytest.mark.long

SMALL = Recipe(
    seed=5, particle=bodies(None)[1], motion=MotionRecipe(17, speed_ms=(1.0, 2.0), spin_rads=(50.0, 300.0)), rig=RigRecipe(drops=2)
)


def test_a_flight_from_recipe_to_row() -> None:
    (row,) = scored_flight(flight(SMALL))
    assert set(row) == {*DESCRIBED, *SCORED, "orientation_max_deg", "by_samples", "rms_ete_px"}
    assert (row["status"], row["n_frames"], row["n_views"], row["by_samples"]) == ("converged", 17, 12, True)
    assert 0 < row["in_plane_percent"] < 20
    assert 0 < row["true_bound_vx"] < row["in_plane_ms"] * 100
    assert 0.05 < row["rms_ete_px"] < 0.5


def test_the_estimator_can_be_asked_otherwise_and_bounds_left_out() -> None:
    (row,) = scored_flight(flight(SMALL, bounded=False, configuration={"minimum_frames": 18}))
    assert row["status"] != "converged"
    assert "true_bound_vx" not in row


def test_poses_of_the_last_placement_from_the_views_of_the_others() -> None:
    case = figure_4.cases(replace(figure_4.PLAN.small, count=2, views=(12,)), None)[1]
    rows = figure_4.pose_errors(dict(case.payload))
    assert len(rows) == 6
    assert sum(row["error_deg"] < 5 for row in rows) >= 4
    assert all(0 < row["rms_px"] <= row["next_rms_px"] for row in rows)


def test_pictures_that_are_left_out_leave_the_others_as_they_are() -> None:
    observation, truth = build_silhouette_sequence(SMALL, 0)
    seen, true = frame_step.every(observation, truth, 4)
    assert len(seen.recordings[0]) == len(seen.clock.times_s) == len(true.motion.times_s) == 5
    np.testing.assert_array_equal(true.motion.v_world, truth.motion.v_world[::4])
    np.testing.assert_array_equal(seen.recordings[0][2].points_px, observation.recordings[0][8].points_px)  # type: ignore[index]
    rows = frame_step.stepped_rows({"recipe": recipe_to_dict(SMALL), "steps": [1]})
    assert [(row["step"], row["n_frames"]) for row in rows] == [(1, 17)]


def test_a_clock_that_nobody_told_is_found_and_scored() -> None:
    case = next(case for case in two_cameras.cases(two_cameras.PLAN.small, None) if case.labels["second"] == two_cameras.UNKNOWN_CLOCK)
    recipe = recipe_from_dict(dict(case.payload)["recipe"], "case")
    quick = replace(recipe, motion=replace(recipe.motion, frames=24), rig=RigRecipe(drops=2))
    (row,) = two_cameras.clocked_flight(flight(quick, bounded=False))
    assert row["status"] == "converged"
    assert abs(row["clock_error_frames"]) < 0.05
    assert 0 < row["clock_sigma_frames"] < 0.05


def test_one_flight_by_every_fit() -> None:
    rows = surface_fit.fitted_rows({"recipe": recipe_to_dict(replace(SMALL, rig=RigRecipe(drops=3)))})
    assert [(row["fit"], row["by_samples"]) for row in rows] == [
        (surface_fit.TANGENTS, False),
        (surface_fit.SAMPLES, True),
        (surface_fit.KNOWN, True),
    ]
    assert len({row["true_bound_vx"] for row in rows}) == 1


def test_a_flight_is_filmed_and_measured() -> None:
    settings = replace(optics.PLAN.small, count=1, frames=9, views=12, samples=1)
    payload: dict[str, Any] = dict(optics.cases(settings, None)[0].payload)
    recipe = recipe_from_dict(payload["recipe"], "case")
    quick = replace(recipe, rendering=replace(recipe.rendering, subframes=2, variant="scalar_rgb"), particle=bodies(None)[1])
    (row,) = optics.filmed_flight({"recipe": recipe_to_dict(quick)})
    assert row["n_frames"] == 9
    assert "true_bound_vx" not in row
