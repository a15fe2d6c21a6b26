"""Consider covariance: what is possible but not fitted widens v, and intervals hold the truth under it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.trajectory import Trajectory
from estimator.data.configuration import Configuration
from estimator.diagnosis.adding import fit_with
from estimator.effects.choosing import catalogue, chosen_effects
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.considered import Considered, considered, doubts_of, stated_possible, widened
from estimator.fitting.campaigns.facts import Fact
from estimator.fitting.campaigns.impacts import impacts
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.motion.flight import N_PARAMETERS, V
from estimator.reports.campaign_reporting import campaign_estimates
from tests.estimator.made_trajectories import RATE_HZ, Hidden, Tracker, flown, measured

Array = NDArray[np.float64]
TRACKER = Tracker(rows=21, orientation=False, stated=True)
SIZE = 0.01
POSSIBLE = Fact("length_scale=±1%", (("length_scale", (1.0,)),), 0.0, SIZE)


def shrunk(seed: int, scale: float) -> tuple[Trajectory, Array]:
    """A trajectory whose lengths are ``scale`` too short, and the true velocity (3,) in its middle row."""
    _, x, _, _ = flown(np.random.default_rng(seed), Hidden(), TRACKER)
    trajectory = measured("toss", np.random.default_rng(seed), Hidden(), TRACKER)
    middle = TRACKER.rows // 2
    return replace(trajectory, x_world=trajectory.x_world / (1.0 + scale)), 0.5 * RATE_HZ * (x[middle + 1] - x[middle - 1])


def pulls(seed: int, facts: tuple[Fact, ...]) -> Array:
    """Errors (3,) of v over their standard deviations, with a length scale drawn for each seed."""
    trajectory, truth = shrunk(seed, float(np.random.default_rng(1000 + seed).normal(0.0, SIZE)))
    registered = register_trajectories([trajectory])
    at, fit = fit_with(registered.campaign, registered.start, ())
    wide = considered(at, fit, campaign_covariance(at, fit), stated_possible(facts, fit.model, catalogue()))
    (estimate,) = campaign_estimates(replace(registered, campaign=at), {"toss": trajectory}, fit, wide, Configuration())
    assert estimate.middle is not None
    return (estimate.middle.v_world - truth) / np.sqrt(np.diag(estimate.middle.covariance)[:3])


def test_intervals_hold_a_hidden_length_scale_where_it_is_considered_and_not_otherwise() -> None:
    seeds = range(40)
    plain, wide = (np.array([pulls(seed, facts) for seed in seeds]) for facts in ((), (POSSIBLE,)))
    assert np.mean(np.abs(plain) < 1.96) < 0.6
    assert np.mean(np.abs(wide) < 1.96) > 0.9
    # Components of one flight have the length scale in common, so that 40 numbers are independent.
    assert np.sqrt(np.mean(wide**2)) == pytest.approx(1.0, abs=0.35)


@pytest.fixture(scope="module")
def fitted() -> tuple[object, object, Considered, Considered]:
    trajectories = [replace(shrunk(seed, 0.0)[0], name=f"toss_{seed}") for seed in range(3)]
    registered = register_trajectories(trajectories)
    at, fit = fit_with(registered.campaign, registered.start, chosen_effects("linear_drag"))
    covariance = campaign_covariance(at, fit)
    possible = stated_possible((POSSIBLE,), fit.model, catalogue())
    return at, fit, considered(at, fit, covariance, ()), considered(at, fit, covariance, possible)


def test_without_anything_possible_nothing_changes(fitted: tuple[object, object, Considered, Considered]) -> None:
    _, _, plain, wide = fitted
    assert plain.fitted.covariance is not None
    assert np.array_equal(plain.covariance.covariance, plain.plain.covariance)
    rows = np.arange(N_PARAMETERS + 1)
    assert np.array_equal(wide.plain.of(1, rows), plain.plain.of(1, rows))
    more = wide.fitted.of(1, rows) - plain.fitted.of(1, rows)
    assert np.linalg.eigvalsh(more).min() > -1e-9 * np.abs(more).max()
    assert np.linalg.matrix_rank(more, tol=1e-9 * np.abs(more).max()) == 1


def test_what_is_possible_is_what_a_shifted_fit_says(fitted: tuple[object, object, Considered, Considered]) -> None:
    """The impact of a length scale is how far v moves where lengths are wrong by its standard deviation."""
    at, fit, _, wide = fitted
    found = impacts(at, fit, wide)  # type: ignore[arg-type]
    (possible,) = [thing for thing in found.things if not thing.fitted]
    registered = register_trajectories([replace(shrunk(seed, SIZE)[0], name=f"toss_{seed}") for seed in range(3)])
    _, shifted = fit_with(registered.campaign, registered.start, chosen_effects("linear_drag"))
    middle = TRACKER.rows // 2 / RATE_HZ
    flights = zip(fit.state.flights, shifted.state.flights, strict=True)  # type: ignore[attr-defined]
    moved = [_velocity(b, middle) - _velocity(a, middle) for a, b in flights]
    assert possible.v_ms == pytest.approx(np.sqrt(np.mean(np.sum(np.square(moved), axis=1))), rel=0.3)


def _velocity(flight: object, time_s: float) -> Array:
    g = np.array([0.0, 0.0, -9.81])
    return flight.v + g * (time_s - flight.time_s)  # type: ignore[attr-defined,no-any-return]


def test_impacts_add_up(fitted: tuple[object, object, Considered, Considered]) -> None:
    """One fitted and one possible thing: with noise, they are the total."""
    at, fit, _, wide = fitted
    found = impacts(at, fit, wide)  # type: ignore[arg-type]
    squares = sum(thing.v_ms**2 for thing in found.things) + found.noise[0] ** 2
    assert np.sqrt(squares) == pytest.approx(found.total[0], rel=1e-6)
    assert found.things[0].name == max(found.things, key=lambda thing: thing.v_ms).name
    (drag,) = [thing for thing in found.things if thing.fitted]
    assert drag.v_ms < drag.v_before_ms
    assert np.isnan(found.total[1]), "no spin was measured"


def test_what_limits_v_is_told_along_the_axes_that_a_film_shows() -> None:
    """Before, of films from the side nothing was told."""
    flat = []
    for seed in range(3):
        trajectory = shrunk(seed, 0.0)[0]
        x = np.where(np.arange(3) == 1, np.nan, trajectory.x_world)
        flat.append(replace(trajectory, name=f"toss_{seed}", x_world=x, sigma_x=np.where(np.isnan(x), np.nan, TRACKER.sigma_x)))
    registered = register_trajectories(flat)
    at, fit = fit_with(registered.campaign, registered.start, ())
    wide = considered(at, fit, campaign_covariance(at, fit), ())
    told = impacts(at, fit, wide)
    estimates = campaign_estimates(replace(registered, campaign=at), {each.name: each for each in flat}, fit, wide, Configuration())
    middles = [each.middle for each in estimates if each.middle is not None]
    squares = [np.nansum(np.diag(each.covariance)[:3]) for each in middles]
    assert told.total[0] == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-6)
    assert told.size[0] == pytest.approx(np.sqrt(np.mean([np.nansum(each.v_world**2) for each in middles])), rel=1e-6)
    assert np.isnan(told.total[1])


def test_a_doubtful_effect_widens_by_what_a_fit_without_it_says() -> None:
    """Half the squared shift, where it is as probable as not that it is there; its own value is as it is, given that it is there."""
    trajectories = [measured(f"toss_{seed}", np.random.default_rng(seed), Hidden(drag=0.02), TRACKER) for seed in range(3)]
    registered = register_trajectories(trajectories)
    campaign, fit = fit_with(registered.campaign, registered.start, chosen_effects("linear_drag"))
    without = fit_campaign(campaign, CampaignState(fit.state.flights, tuple(theta[:0] for theta in fit.state.theta)), Model(()))
    covariance, rows = campaign_covariance(campaign, fit), np.arange(N_PARAMETERS + 1)
    drag = np.array([N_PARAMETERS])
    (doubt,) = doubts_of(campaign, fit, {"linear_drag": 0.5})
    for given, shifted in ((False, doubt.shift), (True, doubt.of_others)):
        more = widened(covariance, [shifted]).of(1, rows) - covariance.of(1, rows)
        shift = without.state.flights[1].values[V] - fit.state.flights[1].values[V]
        assert np.sqrt(2.0 * np.diag(more)[V]) == pytest.approx(np.abs(shift), abs=0.05 * np.abs(shift).max())
        own = 0.0 if given else 0.5 * float(fit.state.theta[1][0]) ** 2
        assert more[np.ix_(drag, drag)].item() == pytest.approx(own, rel=1e-6)
    assert widened(covariance, []).of(1, rows) == pytest.approx(covariance.of(1, rows))
    assert doubts_of(campaign, fit, {}) == ()
