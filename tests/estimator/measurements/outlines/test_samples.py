"""Outlines sample by sample: derivatives, the surface as amplitudes, and that nothing of the eliminated equations is lost by them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.appearance.model_errors import centres_cam
from estimator.appearance.prediction import Prediction
from estimator.data.configuration import Configuration
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.registered import Registered
from estimator.fitting.descent import Effort
from estimator.measurements.outlines import surfaces
from estimator.measurements.outlines.contacts import SECTORS
from estimator.measurements.outlines.registration import by_samples
from estimator.measurements.outlines.surfaces import Flown, with_surface
from estimator.measurements.outlines.task import (
    OutlineTask,
    amplitudes_in,
    outline_errors,
    placed_at,
    with_contacts,
    with_contacts_at,
    with_sectors,
)
from estimator.measurements.silhouettes.registration import _sampled, register
from estimator.motion.flight import COM, N_PARAMETERS, OFFSET, OMEGA, STEPS, Flight, V, moved
from estimator.motion.rigid_body import RanAway
from estimator.surface.amplitudes import Amplitudes
from estimator.surface.joint import Joined, joined
from estimator.surface.shape import Shape
from synth.sequence import build_silhouette_sequence
from tests.estimator import small_campaign

Array = NDArray[np.float64]
RECIPE = Recipe(
    seed=11,
    sequences=2,
    same_particle=True,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.3, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=16, speed_ms=(1.5, 2.5), spin_rads=(120.0, 200.0)),
    rig=RigRecipe(drops=4),
)
COARSE = 4
EFFECTS = (
    *("gravity", "linear_drag", "length_scale", "focal_length", "radial_distortion"),
    *("outline_offset", "view_outline_offset", "rolling_shutter", "blooming"),
)


@pytest.fixture(scope="module")
def tangents() -> Registered:
    return register([build_silhouette_sequence(RECIPE, i)[0] for i in range(2)], Configuration(campaign_surface_fit=0))


@pytest.fixture(scope="module")
def sampled(tangents: Registered) -> Registered:
    """The campaign by samples, about the surface that views and frames show."""
    return by_samples(tangents, [MODELS[key] for key in EFFECTS], Configuration(), subdivisions=COARSE)


@pytest.fixture(scope="module")
def unfollowed(sampled: Registered) -> Campaign:
    """The campaign as it is where flights ran away: its surface is to be fitted yet."""
    return replace(sampled.campaign, sequences=tuple(replace(each, under=None) for each in sampled.campaign.sequences))


@pytest.fixture(scope="module")
def fit(sampled: Registered) -> CampaignFit:
    return base_fit(sampled.campaign, sampled.start)


@pytest.fixture(scope="module")
def followed(unfollowed: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignFit, Joined[Flown]]:
    """The campaign about the surface that views and frames show, its fit, and the fit of all corners that it comes from."""
    kept: list[Joined[Flown]] = []

    def fitted(*arguments: Any, **named: Any) -> Joined[Flown]:
        kept.append(joined(*arguments, **named))
        return kept[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surfaces, "joined", fitted)
        campaign, state = unfollowed.kind.relinearised(unfollowed, fit)
    return campaign, fit_campaign(campaign, state, fit.model), kept[-1]


def test_shapes_of_outlines_are_kept_where_the_surface_hardly_moves(
    sampled: Registered, followed: tuple[Campaign, CampaignFit, Joined[Flown]]
) -> None:
    flight = sampled.start.flights[0]
    before = sampled.campaign.sequences[0]
    bare = replace(before, amplitudes=Amplitudes.none(before.amplitudes.surface), made_at=None)
    task = with_contacts_at(bare, placed_at(bare, flight, Model(), np.zeros(0)), Model(), np.zeros(0))
    task = with_sectors(task, *_placed(task, flight))
    surface = followed[0].sequences[0].amplitudes.surface
    for by_px, kept in ((0.0, True), (10.0, False)):
        moved_surface = surface.moved(by_px * task.view_px_m * surface.normals)
        (met,) = with_surface([Flown(task, flight, Model(), np.zeros(0))], Shape(moved_surface, 0.2), sampled.campaign.kind)
        assert (met.task.sectors is task.sectors) is kept


def _placed(task: OutlineTask, flight: Flight) -> tuple[Prediction, Array]:
    prediction, placed = placed_at(task, flight, Model(), np.zeros(0))
    return prediction, centres_cam(flight, placed)


def test_the_fit_ends_where_all_corners_end(followed: tuple[Campaign, CampaignFit, Joined[Flown]]) -> None:
    campaign, again, joint = followed
    covariance = campaign_covariance(campaign, again)
    assert again.settled
    assert joint.settled
    for i, flown in enumerate(joint.recorded):
        sd = np.sqrt(np.diag(joint.covariance)[flown.place])
        off = [
            (getattr(again.state.flights[i], name) - getattr(flown.flight, name)) / sd[part] for part, name in ((V, "v"), (OMEGA, "omega"))
        ]
        assert np.sqrt(np.mean(np.square(off))) < 0.4  # one of six is off by 0.7 at times: steps end at 0.3
        found = np.sqrt(np.diag(covariance.of(i, np.arange(N_PARAMETERS))))
        assert found[OMEGA] == pytest.approx(sd[OMEGA], rel=0.3)  # means over sectors say less


def test_mass_properties_are_those_off_the_surface(followed: tuple[Campaign, CampaignFit, Joined[Flown]]) -> None:
    campaign, again, joint = followed
    task, flight = campaign.sequences[0], again.state.flights[0]
    change = task.amplitudes.mass @ np.append(1.0, again.state.theta[0])
    sd = np.sqrt(np.diag(joint.covariance)[joint.recorded[0].place])
    assert np.all(np.abs(flight.com + change[:3] - joint.recorded[0].flight.com) < sd[COM])
    assert np.all(np.abs(np.concatenate([flight.com, flight.inertia])) < 4.0 * task.deviation)


def test_outlines_without_an_offset_are_found_to_have_none(sampled: Registered, fit: CampaignFit) -> None:
    covariance = campaign_covariance(sampled.campaign, fit)
    sd = np.sqrt(np.diag(covariance.of(0, np.arange(N_PARAMETERS)))[OFFSET])[0]
    assert sd < Configuration().offset_prior_px
    assert abs(fit.state.flights[0].offset_px) < 2.5 * sd


def test_amplitudes_are_of_variance_one(fit: CampaignFit, sampled: Registered) -> None:
    amplitudes = fit.state.theta[0]
    assert len(amplitudes) == sampled.campaign.kind.base.size > 20
    assert np.all(fit.state.theta[1] == amplitudes)
    assert 0.05 < np.sqrt(np.mean(amplitudes**2)) < 1.5


def test_with_few_views_campaigns_are_fitted_by_samples_where_that_is_always_asked_for(tangents: Registered) -> None:
    asked = [Configuration(campaign_surface_fit=number) for number in range(3)]
    assert [_sampled(tangents, each) for each in asked] == [False, True, True]
    assert [_sampled(small_campaign.registered(), each) for each in asked] == [False, False, True]


def test_surfaces_are_fitted_once_under_a_model(sampled: Registered, fit: CampaignFit) -> None:
    campaign, _ = sampled.campaign.kind.relinearised(sampled.campaign, fit)
    assert all(each.under == () for each in campaign.sequences)
    assert all(new.contacts.point is old.contacts.point for new, old in zip(campaign.sequences, sampled.campaign.sequences, strict=True))


def test_a_campaign_whose_flights_run_away_begins_with_the_hull(tangents: Registered, monkeypatch: pytest.MonkeyPatch) -> None:
    def astray(*_arguments: Any, **_named: Any) -> None:
        raise RanAway("a test's")

    monkeypatch.setattr(surfaces, "joined", astray)
    made = by_samples(tangents, [MODELS["gravity"]], Configuration(), subdivisions=COARSE - 1)
    assert made.campaign.kind.base.size > 0
    assert all(each.under is None for each in made.campaign.sequences)


def test_surfaces_of_views_that_are_drawn_too_large_are_smaller(unfollowed: Campaign, fit: CampaignFit) -> None:
    campaign, by_px = unfollowed, 2.0
    model = Model((*fit.model.effects, MODELS["view_outline_offset"]))
    theta = tuple(np.append(each, by_px) for each in fit.state.theta)
    drawn = fit_campaign(campaign, CampaignState(fit.state.flights, theta), model, Effort(1, 1))
    made, _ = campaign.kind.relinearised(campaign, replace(drawn, state=CampaignState(drawn.state.flights, theta)))
    plain, _ = campaign.kind.relinearised(campaign, fit)
    smaller, surface = made.sequences[0].amplitudes.surface, plain.sequences[0].amplitudes.surface
    inwards = np.sum((surface.vertices - smaller.vertices) * surface.normals, axis=1)
    assert made.sequences[0].views_px == by_px
    assert np.median(inwards) == pytest.approx(by_px * made.sequences[0].view_px_m, rel=0.1)


def _theta(model: Model) -> Array:
    """Parameters at which every effect of the model acts."""
    theta = np.zeros(model.size)
    theta[amplitudes_in(model)] = np.random.default_rng(0).normal(size=theta[amplitudes_in(model)].shape)
    theta[len(theta[amplitudes_in(model)]) :] = 3.0 * model.steps[len(theta[amplitudes_in(model)]) :]
    return theta


@pytest.mark.parametrize("key", EFFECTS)
def test_derivatives_by_effects_are_those_of_differences(key: str, fit: CampaignFit, sampled: Registered) -> None:
    campaign = sampled.campaign
    model = Model((*campaign.kind.base.effects, MODELS[key]))
    theta, task, flight = _theta(model), campaign.sequences[0], fit.state.flights[0]
    at = outline_errors(task, flight, model, theta)
    for column in range(model.size - len(MODELS[key].entry.parameters), model.size):
        step = model.steps[column] * np.eye(model.size)[column]
        high, low = (outline_errors(task, flight, model, theta + sign * step) for sign in (1.0, -1.0))
        difference = (high.e - low.e) / (2.0 * model.steps[column])
        size = np.abs(difference).max()
        assert size > 0.0
        assert np.abs(at.J[..., N_PARAMETERS + column] - difference).max() < 0.02 * size


def test_derivatives_by_the_flight_and_amplitudes_are_those_of_differences(fit: CampaignFit, sampled: Registered) -> None:
    campaign = sampled.campaign
    model, task, flight = campaign.kind.base, campaign.sequences[1], fit.state.flights[1]
    theta = fit.state.theta[1]
    at = outline_errors(task, flight, model, theta)
    assert at.e.shape == (16, SECTORS)
    for column in np.flatnonzero(STEPS):
        step = STEPS[column] * np.eye(N_PARAMETERS)[column]
        high, low = (outline_errors(task, moved(flight, sign * step), model, theta) for sign in (1.0, -1.0))
        difference = (high.e - low.e) / (2.0 * STEPS[column])
        assert np.abs(at.J[..., column] - difference).max() < 0.02 * max(np.abs(difference).max(), 1e-3 / STEPS[column] * 1e-3)
    assert (at.J[..., OFFSET][..., 0] * np.sqrt(at.variance))[at.seen] == pytest.approx(-1.0)
    for column in (0, model.size - 1):
        step = 0.1 * np.eye(model.size)[column]
        high, low = (outline_errors(task, flight, model, theta + sign * step) for sign in (1.0, -1.0))
        difference = (high.e - low.e) / 0.2
        assert np.abs(at.J[..., N_PARAMETERS + column] - difference).max() < 0.05 * np.abs(difference).max()


def test_contacts_are_made_anew_where_outlines_have_moved(fit: CampaignFit, sampled: Registered) -> None:
    campaign = sampled.campaign
    model, task, flight, theta = campaign.kind.base, campaign.sequences[0], fit.state.flights[0], fit.state.theta[0]
    assert with_contacts(task, flight, model, theta) is task
    turned = moved(flight, 0.05 * np.eye(N_PARAMETERS)[5])
    anew = with_contacts(task, turned, model, theta)
    assert anew is not task
    old, new = (outline_errors(each, turned, model, theta) for each in (task, anew))
    assert np.sum(new.e**2) < 0.95 * np.sum(old.e**2)  # points that have slid along the outline are nearer than those that were met


def test_outlines_that_are_off_as_a_whole_show_in_every_sector(fit: CampaignFit, sampled: Registered) -> None:
    campaign = sampled.campaign
    task, sightings = campaign.sequences[0], campaign.sequences[0].task.sightings
    shifted = replace(sightings, outlines_px=tuple(outline + np.array([1.0, 0.0]) for outline in sightings.outlines_px))
    moved_task = replace(task, task=replace(task.task, sightings=shifted))
    model, flight, theta = campaign.kind.base, fit.state.flights[0], fit.state.theta[0]
    before, after = (outline_errors(each, flight, model, theta) for each in (task, moved_task))
    change = (after.e - before.e) * np.sqrt(before.variance)
    normal = task.contacts.mean(task.contacts.normal)[..., 0]
    assert change[before.seen] == pytest.approx(normal[before.seen], abs=1e-6)


def test_some_sightings_alone_have_the_residuals_that_they_have_among_all(fit: CampaignFit, sampled: Registered) -> None:
    task, at, rows = sampled.campaign.sequences[0], (fit.state.flights[0], fit.model, fit.state.theta[0]), np.array([1, 4, 9])
    every, some = (outline_errors(each, *at) for each in (task, task.take(rows)))
    np.testing.assert_array_equal(some.seen, every.seen[rows])
    np.testing.assert_allclose(some.e, every.e[rows], atol=1e-3)  # flights are integrated from sighting to sighting, further here
    np.testing.assert_allclose(some.J, every.J[rows], atol=1e-4 * np.abs(every.J).max())
