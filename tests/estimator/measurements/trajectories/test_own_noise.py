"""Every flight has a noise of its own: a bad one weighs less, and the others as much as before."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.registered import Registered
from estimator.fitting.campaigns.weighing_again import weighed_again
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, campaign

Array = NDArray[np.float64]
BAD, TIMES = 2, 6.0
FLIGHTS = 6
STATED = Tracker(rows=40, stated=True)


@cache
def registered(*, bad: bool) -> Registered:
    """Flights whose noise is stated; one has six times as much."""
    made = campaign(17, Hidden(), STATED, sequences=FLIGHTS)
    rng, off = np.random.default_rng(5), float(np.sqrt(TIMES**2 - 1.0)) * STATED.sigma_x
    return register_trajectories(
        [
            replace(each, x_world=each.x_world + off * rng.normal(size=each.x_world.shape)) if bad and i == BAD else each
            for i, each in enumerate(made)
        ]
    )


@cache
def weighed(*, bad: bool) -> tuple[Campaign, CampaignFit]:
    found = registered(bad=bad)
    return weighed_again(found.campaign, base_fit(found.campaign, found.start))


def noises(*, bad: bool) -> Array:
    return np.array([task.noise for task in weighed(bad=bad)[0].sequences])


def test_a_bad_flight_is_given_more_noise_and_the_others_their_own() -> None:
    """Its positions are off sixfold, its turns are not: over both that is four times as much."""
    found = noises(bad=True)
    others = np.delete(found, BAD)
    assert found[BAD] > 2.5
    assert np.all((others > 0.8) & (others < 1.2)), others
    np.testing.assert_allclose(others, np.delete(noises(bad=False), BAD), rtol=0.02)


def test_where_no_flight_is_bad_all_noise_is_as_stated() -> None:
    found = noises(bad=False)
    assert np.all((found > 0.8) & (found < 1.2)), found


def test_another_noise_multiplies_what_was_stated_once() -> None:
    """Not once more for every time that it is asked for."""
    task = registered(bad=False).campaign.sequences[0]
    twice, again = task.with_noise(2.0), task.with_noise(3.0).with_noise(2.0)
    np.testing.assert_allclose(twice.sigma, 2.0 * task.sigma)
    np.testing.assert_allclose(again.sigma, twice.sigma, rtol=1e-12)
    assert (task.noise, twice.noise, again.noise) == (1.0, 2.0, 2.0)
    np.testing.assert_allclose(again.with_noise(1.0).sigma, task.sigma, rtol=1e-12)


def test_what_was_not_measured_stays_so() -> None:
    task = registered(bad=False).campaign.sequences[0]
    unseen = replace(task, sigma=np.where(np.arange(len(task.sigma))[:, None] == 3, np.inf, task.sigma))
    assert np.isinf(unseen.with_noise(2.0).sigma[3]).all()


def test_the_scales_do_not_change_when_they_are_asked_for_again() -> None:
    """They are those over what was stated, whatever the weights at the time."""
    there, fit = weighed(bad=True)
    again, _ = weighed_again(there, fit)
    np.testing.assert_allclose([t.noise for t in again.sequences], noises(bad=True), rtol=0.02)
    scales = there.kind.noise_scales(there, fit.equations)
    assert scales is not None
    np.testing.assert_allclose(scales, noises(bad=True), rtol=0.02)


def test_the_density_of_a_fit_hardly_depends_on_the_weights_it_was_found_with() -> None:
    """The noise is integrated, so that fits of different weights can be compared."""
    found = registered(bad=False)
    fit = base_fit(found.campaign, found.start)
    there, again = weighed(bad=False)
    density = [c.kind.density(c, f.equations).log() for c, f in ((found.campaign, fit), (there, again))]
    assert density[0] == pytest.approx(density[1], abs=0.5)


PUSH_MS2, HELD_MS2 = 2.0, 0.05


def pushes(*, tails: bool) -> Array:
    """Fitted accelerations (s,) along x of every flight, under a prior with or without tails; one flight is really pushed."""
    made = campaign(17, Hidden(), STATED, sequences=FLIGHTS)
    away = 0.5 * PUSH_MS2 * made[BAD].times_s[:, None] ** 2 * [1.0, 0.0, 0.0]
    found = register_trajectories([replace(each, x_world=each.x_world + (i == BAD) * away) for i, each in enumerate(made)])
    effect = MODELS["uniform_acceleration"].held_by((HELD_MS2,) * 3, tails=tails)
    start = CampaignState(found.start.flights, tuple(np.zeros(3) for _ in found.start.flights))
    fit = fit_campaign(found.campaign, start, Model((effect,)))
    assert fit.settled
    return np.array([theta[0] for theta in fit.state.theta])


def test_tails_let_one_flight_stand_out_and_hold_the_others() -> None:
    """Forty times as far as the prior is wide: with tails it is pushed as much as it was, without it is held back."""
    with_tails, without = pushes(tails=True), pushes(tails=False)
    assert with_tails[BAD] == pytest.approx(PUSH_MS2, abs=0.1)
    assert without[BAD] < 0.9 * PUSH_MS2
    assert np.abs(np.delete(with_tails, BAD)).max() < 2.0 * HELD_MS2
