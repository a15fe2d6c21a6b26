"""Campaigns of two cameras: an effect of one of them is named with it, a clock that is not known is fitted, and controls are clean.

Outlines have the mess of the field: heavy tails, alike over frames, some shifted as a whole; every flight is pushed a little.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from datasets.observation import Observation
from datasets.recipes.recipe import EffectRecipe, FurtherHsvRecipe, Recipe
from datasets.vocabulary.effects import Stage
from estimator.data.configuration import ALWAYS, Configuration
from estimator.diagnosis.adding import fit_with
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.effects.instrument.uncertain_lens import UncertainLens
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.registered import Registered
from estimator.likelihood.time_shifts import jitter_test
from estimator.measurements.outlines.frame_noise import whole
from estimator.measurements.outlines.kind import Outlines
from estimator.measurements.silhouettes.registration import register
from estimator.reports.clock_reporting import clocks_of_campaign
from synth.frame_outlines import frame_outlines
from synth.sequence import exact_view_outlines, observation_of, plan_sequence
from synth.silhouette import outline_mesh
from tests.estimator import small_campaign
from tumble.challenge.field_silhouettes import messy

pytestmark = pytest.mark.long

SIGMA_PX, ALIKE, SHIFTED = 0.15, 2, 0.015
INTERVAL_S = 1.0 / 4000.0
PUSHES = EffectRecipe("uniform_acceleration", {"a_x": (0.1, -0.05), "a_y": (-0.1, 0.08), "a_z": (0.05, 0.1)})
SECOND = FurtherHsvRecipe(angle_deg=90.0, offset_sigma_frames=0.5, hidden_offset_frames=(-0.6, 0.6))
HIDDEN = {
    "focal_length@hsv_2": EffectRecipe("focal_length", {"relative": 0.01}, 1),
    "outline_offset@hsv": EffectRecipe("outline_offset", {"offset": 0.4}, 0),
}


def recipe(*effects: EffectRecipe, second: FurtherHsvRecipe) -> Recipe:
    return replace(small_campaign.recipe(PUSHES, *effects, frames=16), further_hsv=(second,))


def observations(made: Recipe) -> list[Observation]:
    plans = [plan_sequence(made, number) for number in range(made.sequences)]
    rng = np.random.default_rng(3)
    views = messy(exact_view_outlines(plans[0]), SIGMA_PX, 1, 0.0, rng)
    found = []
    for plan in plans:
        exact = [frame_outlines(each, outline_mesh(each.vertices, each.faces)) for each in plan.by_camera]
        found.append(observation_of(plan, [messy(outlines, SIGMA_PX, ALIKE, SHIFTED, rng) for outlines in exact], views))
    return found


@cache
def registered(key: str, second: FurtherHsvRecipe = SECOND) -> Registered:
    return register(observations(recipe(*([HIDDEN[key]] if key else []), second=second)), Configuration())


@cache
def explained(key: str, second: FurtherHsvRecipe = SECOND) -> Explanation:
    found = registered(key, second)
    return explain(found.campaign, found.start, catalogue(found.campaign.cameras))


@pytest.mark.parametrize("key", HIDDEN)
def test_the_effect_is_named_with_its_camera(key: str) -> None:
    found = explained(key)
    assert found.found == (key,)
    assert found.steps[0].established
    (true,) = HIDDEN[key].values.values()
    at = found.fit.model.slices[found.fit.model.keys.index(key)]
    assert found.fit.state.theta[0][at] == pytest.approx(true, rel=0.1)


def test_a_control_is_clean() -> None:
    assert explained("").found == ()
    assert explained("").left is None or not explained("").left.present


def test_a_clock_that_is_not_known_is_fitted_in_every_recording() -> None:
    """To a fiftieth of a frame, though it is off by up to a half."""
    campaign, found = registered("").campaign, explained("")
    assert not registered("").left_out
    at = found.fit.model.slices[found.fit.model.keys.index("uncertain_clock@hsv_2")]
    offsets = np.array([theta[at][0] for theta in found.fit.state.theta])
    true = [plan_sequence(recipe(second=SECOND), number).further[0].clock_error[0] for number in range(len(campaign.sequences))]
    np.testing.assert_allclose(offsets, true, atol=0.02 * INTERVAL_S)
    told = clocks_of_campaign(found.fit, 1, campaign_covariance(campaign, found.fit))["hsv_2"]
    assert (told["offset_s"], told["offset_s_stated_sigma"]) == (offsets[1], 0.5 * INTERVAL_S)
    assert abs(offsets[1] - true[1]) < 4.0 * told["offset_s_sigma"] < 0.2 * INTERVAL_S


@pytest.mark.parametrize("surface_fit", [0, ALWAYS])
def test_a_lens_that_is_off_by_as_much_as_stated_is_fitted_and_not_named(surface_fit: int) -> None:
    made = observations(recipe(HIDDEN["focal_length@hsv_2"], second=FurtherHsvRecipe(angle_deg=90.0)))
    lens = made[0].cameras[1].intrinsics
    error = 0.01 * np.array([lens.fx_px, lens.fy_px, *(0.0,) * 7])
    stated = replace(made[0].cameras[1], lens_covariance=np.outer(error, error))
    found = register([replace(each, cameras=(each.cameras[0], stated)) for each in made], Configuration(campaign_surface_fit=surface_fit))
    begun = base_fit(found.campaign, found.start)
    assert begun.model.keys[1:] == ("uncertain_lens@hsv_2",)
    effect, (amplitude,) = begun.model.effects[1], begun.state.theta[0][begun.model.slices[1]]
    assert isinstance(effect, UncertainLens)
    np.testing.assert_allclose(amplitude * effect.errors[0], error, rtol=0.05)
    assert begun.state.theta[1][begun.model.slices[1]] == amplitude
    lenses = {key: each for key, each in catalogue(found.campaign.cameras).items() if each.entry.stage is Stage.OPTICS and each.camera}
    assert diagnose(*fit_with(found.campaign, found.start, ()), lenses).missing == ()


def test_a_clock_that_is_off_though_stated_as_known_is_found() -> None:
    known = replace(SECOND, offset_sigma_frames=0.0, hidden_offset_frames=(0.4, 0.4))
    found = explained("", known)
    assert found.found == ("clock_offset@hsv_2",)
    assert found.fit.state.theta[0][found.fit.model.slices[-1]] == pytest.approx(0.4 * INTERVAL_S, abs=0.02 * INTERVAL_S)


def test_what_does_not_apply_says_why() -> None:
    campaign = registered("").campaign
    assert campaign.cameras == ("hsv", "hsv_2")
    lens, clock = MODELS["focal_length"], MODELS["clock_offset"]
    assert campaign.kind.why_not(campaign, lens.of_camera("hsv_2")) is None
    assert campaign.kind.why_not(campaign, lens.of_camera("side")) == "there is no camera side, but hsv and hsv_2"
    assert campaign.kind.why_not(campaign, clock.of_camera("hsv")) == "it is of a further camera against the first one"
    assert campaign.kind.why_not(campaign, clock.of_camera("hsv_2")) is None


def test_cameras_that_film_nothing_together_have_no_clocks_to_compare() -> None:
    first, second = small_campaign.observations()
    other = replace(second, cameras=tuple(replace(camera, name="right") for camera in second.cameras))
    campaign = register([first, other], Configuration()).campaign
    assert campaign.cameras == ("hsv", "right")
    assert (
        campaign.kind.why_not(campaign, catalogue(campaign.cameras)["clock_offset@right"])
        == "it is of a further camera against the first one"
    )


def test_sample_by_sample_a_campaign_has_the_clocks_too() -> None:
    found = register(observations(recipe(HIDDEN["focal_length@hsv_2"], second=SECOND)), Configuration(campaign_surface_fit=ALWAYS))
    assert isinstance(found.campaign.kind, Outlines)
    begun = base_fit(found.campaign, found.start)
    assert begun.model.keys[1:] == ("uncertain_clock@hsv_2",)
    cameras = found.campaign.cameras
    focal = {key: effect for key, effect in catalogue(cameras).items() if key.startswith("focal_length")}
    assert diagnose(*fit_with(found.campaign, found.start, ()), focal).missing == ("focal_length@hsv_2",)


def test_outlines_of_a_camera_that_is_off_are_not_off_as_a_whole() -> None:
    """Both cameras show every moment, so what one of them is off by comes and goes from outline to outline in time."""
    second = FurtherHsvRecipe(angle_deg=90.0, offset_sigma_frames=2.0, hidden_offset_frames=(1.9, 1.9))
    found = registered("", second)
    assert max(int((~each).sum()) for each in whole(found)) <= 1  # of 32 in each flight, one in 67 is drawn so


@pytest.mark.parametrize(
    ("effect", "jitters"), [(HIDDEN["focal_length@hsv_2"], False), (EffectRecipe("trigger_jitter", {"sigma": 2e-5}), True)]
)
def test_what_a_camera_is_off_by_is_no_jitter(effect: EffectRecipe, jitters: bool) -> None:
    found = register(observations(recipe(effect, second=FurtherHsvRecipe(angle_deg=90.0))), Configuration())
    begun = base_fit(found.campaign, found.start)
    assert (jitter_test(found.campaign.time_shifts(begun.equations)).p < 0.01) == jitters
