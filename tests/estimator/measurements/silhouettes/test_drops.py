"""Drops onto a plate in a campaign: flights before and after the impact, drag found in both, and the impact under it."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import DropperRecipe, EffectRecipe
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.diagnosis.adding import fit_with
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign import CampaignFit, CampaignState
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.considered import uncertain
from estimator.fitting.campaigns.registered import Registered
from estimator.impacts.impact_contacts import CLEAR_CHI_SQUARE
from estimator.measurements.silhouettes.registration import register
from estimator.reports.campaign_reporting import campaign_estimates, settled_fit
from synth.sequence import build_silhouette_campaign
from tests.estimator.test_measure import RECIPE

pytestmark = pytest.mark.long

DRAG = 2.0
CONFIGURATION = Configuration(momentum_starts=0, trajectory_candidates=1)
DROPS = replace(
    RECIPE,
    seed=1,
    sequences=2,
    same_particle=True,
    effects=(EffectRecipe("quadratic_drag", {"per_length": DRAG}),),
    dropper=DropperRecipe(runs=2, height_mm=(80.0, 100.0), frames_before=(40, 40), frames_after=(40, 40)),
)


@pytest.fixture(scope="module")
def made() -> list[tuple[Observation, Truth]]:
    return build_silhouette_campaign(DROPS)


@pytest.fixture(scope="module")
def found(made: list[tuple[Observation, Truth]]) -> Registered:
    return register([observation for observation, _ in made], CONFIGURATION)


def with_drag(found: Registered) -> tuple[Registered, CampaignFit]:
    campaign, fit = fit_with(found.campaign, found.start, [catalogue()["quadratic_drag"]])
    at = replace(found, campaign=campaign)
    return at, settled_fit(at, fit)


@pytest.fixture(scope="module")
def fitted(found: Registered) -> tuple[Registered, CampaignFit]:
    return with_drag(found)


def drag_of(registered: Registered, fit: CampaignFit) -> tuple[float, float]:
    """Fitted drag and its standard deviation (1/m)."""
    last = campaign_covariance(registered.campaign, fit)
    return float(fit.state.theta[0][-1]), float(np.sqrt(last.covariance[last.place[0][-1], last.place[0][-1]]))


@pytest.fixture(scope="module")
def estimates(made: list[tuple[Observation, Truth]], fitted: tuple[Registered, CampaignFit]) -> tuple[Estimate, ...]:
    registered, fit = fitted
    of = uncertain(registered.campaign, fit, catalogue())
    return campaign_estimates(registered, {o.name: o for o, _ in made}, of.fit, of.at, CONFIGURATION)


def test_every_flight_is_a_sequence_of_its_recording(made: list[tuple[Observation, Truth]], found: Registered) -> None:
    campaign = found.campaign
    assert campaign.recording == tuple(o.name for o, _ in made for _ in range(2))
    for number, (sequence, name) in enumerate(zip(campaign.sequences, campaign.recording, strict=True)):
        (impact,) = next(truth for observation, truth in made if observation.name == name).impacts
        times = sequence.task.sightings.times_s
        assert np.all((times < impact.time_s) if number % 2 == 0 else (times > impact.time_s))
        assert len(times) > 30
        assert sequence.number == 1 + number % 2


def test_drag_is_that_of_all_flights(found: Registered, fitted: tuple[Registered, CampaignFit]) -> None:
    """Those before the impact alone, which are the faster ones, leave it more uncertain."""
    value, sigma = drag_of(*fitted)
    assert abs(value - DRAG) < 4.0 * sigma
    assert sigma < 0.2 * DRAG
    rows = [0, 2]
    start = CampaignState(*(tuple(each[i] for i in rows) for each in (found.start.flights, found.start.theta)))
    assert drag_of(*with_drag(replace(found, campaign=found.campaign.part(rows), start=start)))[1] > 1.02 * sigma


def test_estimates_of_drops_have_segments_and_impacts(made: list[tuple[Observation, Truth]], estimates: tuple[Estimate, ...]) -> None:
    assert [each.name for each in estimates] == [observation.name for observation, _ in made]
    for estimate, (observation, truth) in zip(estimates, made, strict=True):
        assert estimate.status is Status.CONVERGED
        assert "2 flights and 1 impact" in estimate.message
        assert "quadratic drag" in estimate.message
        (found,), (true,) = estimate.impacts, truth.impacts
        assert abs(found.time_s - true.time_s) < 4.0 * found.time_sigma_s + true.duration_s
        for velocity, v, omega in ((found.before, true.v_before, true.omega_before), (found.after, true.v_after, true.omega_after)):
            error = np.concatenate([velocity.v_world - v, velocity.omega_world - omega])
            assert np.all(np.abs(error) < 4.5 * np.sqrt(np.diag(velocity.covariance)))
        first, second = estimate.segments
        assert first.end_s == found.time_s == second.start_s
        assert estimate.motion is not None
        np.testing.assert_array_equal(estimate.motion.times_s, observation.clock.times_s)
        assert len(estimate.parameters) == len(estimate.values) == len(estimate.covariance)
        assert estimate.statistics["impacts"][0]["chi_square"] < CLEAR_CHI_SQUARE
