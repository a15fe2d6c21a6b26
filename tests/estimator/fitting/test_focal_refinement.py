"""The focal length measured with a flight: a camera that states 5% too much, with a short lens and with a long one."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from synth.sequence import build_silhouette_sequence

WRONG_BY = 1.05
RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.8, size_mm=(7.0, 7.0)),
    motion=MotionRecipe(frames=30, speed_ms=(2.0, 3.0), spin_rads=(150.0, 200.0)),
    hsv=HsvRecipe(focal_mm=12.0, distance_m=0.05),
    rig=RigRecipe(drops=4),
)


def misled(recipe: Recipe) -> tuple[Observation, Truth]:
    """A sequence whose camera states a focal length ``WRONG_BY`` times the true one."""
    observation, truth = build_silhouette_sequence(recipe, 0)
    camera = observation.cameras[0]
    k = camera.intrinsics
    stated = replace(k, fx_px=WRONG_BY * k.fx_px, fy_px=WRONG_BY * k.fy_px)
    return replace(observation, cameras=(replace(camera, intrinsics=stated),)), truth


def depth_error(result: Estimate, truth: Truth) -> float:
    """Largest relative error of the distance."""
    assert result.motion is not None
    return float(np.abs(result.motion.x_world[:, 2] / truth.motion.x_world[:, 2] - 1.0).max())


@pytest.fixture(scope="module")
def near() -> tuple[Observation, Truth, Estimate]:
    observation, truth = misled(RECIPE)
    return observation, truth, estimate(observation, Configuration(focal_prior=0.2))


def test_a_short_lens_tells_its_focal_length(near: tuple[Observation, Truth, Estimate]) -> None:
    _, truth, result = near
    assert result.status is Status.CONVERGED
    found, sigma = result.values[-1], np.sqrt(result.covariance[-1, -1])
    assert result.parameters[-1] == "log_focal_factor"
    assert sigma < 0.02
    assert abs(found + np.log(WRONG_BY)) < 4.0 * sigma
    assert depth_error(result, truth) < 4.0 * sigma


def test_a_focal_length_taken_for_known_puts_the_particle_too_far_away(near: tuple[Observation, Truth, Estimate]) -> None:
    observation, truth, measured = near
    believed = estimate(observation, Configuration())
    assert depth_error(believed, truth) == pytest.approx(WRONG_BY - 1.0, abs=0.02)
    assert depth_error(measured, truth) < 0.5 * depth_error(believed, truth)
    assert "focal_length" not in believed.statistics
    assert len(believed.parameters) == 21


def test_what_was_found_is_stated_with_its_error_bar(near: tuple[Observation, Truth, Estimate]) -> None:
    observation, _, result = near
    told = result.statistics["focal_length"]
    stated = observation.cameras[0].intrinsics.fx_px
    assert told["camera_px"][0] == stated
    assert told["focal_px"][0] == pytest.approx(stated * np.exp(result.values[-1]))
    assert told["statement"] in result.message
    assert "prior" not in told["statement"]
    assert result.covariance.shape == result.bound.shape == (22, 22)


def test_a_long_lens_says_that_the_prior_holds_it_and_its_uncertainty_enters_the_velocity_along_the_axis() -> None:
    observation, truth = misled(replace(RECIPE, hsv=HsvRecipe()))
    known, free = (estimate(observation, Configuration(focal_prior=p)) for p in (0.0, 0.05))
    assert "prior" in free.statistics["focal_length"]["statement"]
    assert known.middle is not None
    assert free.middle is not None
    v, sigma = free.middle.v_world, np.sqrt(np.diag(free.middle.covariance))
    true = truth.motion.v_world[(len(truth.motion.times_s) - 1) // 2]
    assert sigma[2] > 0.03 * abs(v[2])
    assert abs(v[2] - true[2]) < 4.0 * sigma[2]
    np.testing.assert_allclose(v[:2], known.middle.v_world[:2], atol=0.01 * np.linalg.norm(true))


def test_two_cameras_are_refused_with_a_reason(near: tuple[Observation, Truth, Estimate]) -> None:
    observation = near[0]
    two = replace(observation, cameras=observation.cameras * 2, recordings=tuple(observation.recordings) * 2)
    with pytest.raises(InputError, match="one high-speed camera"):
        estimate(two, Configuration(focal_prior=0.05))
