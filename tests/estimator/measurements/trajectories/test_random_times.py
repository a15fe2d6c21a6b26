"""Random times of the rows: they are as large as the data say, whatever was missing when they were found."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.diagnosis.adding import fit_with
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.registered import Registered
from estimator.likelihood.rows import HUBER
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.motion.flight import N_PARAMETERS, moved
from estimator.reports.campaign_reporting import effect_values
from tests.estimator.made_trajectories import RATE_HZ, Hidden, Tracker, campaign

Array = NDArray[np.float64]
JITTER_S = 1e-3
LONG = Tracker(rows=80, stated=True)
ROWS_ALIKE = 4


def shaken(hidden: Hidden, tracker: Tracker, seed: int = 4) -> Registered:
    """Flights whose rows were taken at random times about their stamps."""
    rng = np.random.default_rng(seed)
    made = [replace(each, times_s=each.times_s + rng.normal(0.0, JITTER_S, tracker.rows)) for each in campaign(seed, hidden, tracker)]
    return register_trajectories(made)


def test_random_times_shrink_when_a_smooth_effect_comes_that_they_stood_for() -> None:
    """Drag of 1/m bends these flights by more than a millisecond of their way."""
    found = shaken(Hidden(drag=1.0), LONG)
    effects = [MODELS["trigger_jitter"], MODELS["quadratic_drag"]]
    _, fit = fit_with(found.campaign, found.start, effects)
    _, before = fit_with(found.campaign, found.start, effects[:1])
    assert before.model.random_sigma(before.state.theta[0]) > 1.5 * JITTER_S
    assert fit.model.random_sigma(fit.state.theta[0]) == pytest.approx(JITTER_S, rel=0.1)


def alike(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Noise of variance 1 that is the same over ``ROWS_ALIKE`` rows."""
    steps = rng.normal(size=(-(-shape[0] // ROWS_ALIKE), *shape[1:]))
    return np.repeat(steps, ROWS_ALIKE, axis=0)[: shape[0]]


def test_noise_that_repeats_is_as_stated_beside_random_times() -> None:
    """Along the motion every row is a number of its own, across it every fourth."""
    rng, tracker = np.random.default_rng(7), replace(LONG, rows=400, orientation=False)
    quiet = replace(tracker, sigma_x=1e-9)
    made = [
        replace(
            each,
            times_s=np.arange(tracker.rows) / RATE_HZ + rng.normal(0.0, JITTER_S, tracker.rows),
            x_world=each.x_world + tracker.sigma_x * alike(rng, each.x_world.shape),
            sigma_x=np.full(each.x_world.shape, tracker.sigma_x),
        )
        for each in campaign(7, Hidden(), quiet)
    ]
    found = register_trajectories(made)
    tasks = tuple(replace(task, repeats=np.full_like(task.repeats, float(ROWS_ALIKE))) for task in found.campaign.sequences)
    there, model = replace(found.campaign, sequences=tasks), Model((MODELS["trigger_jitter"],))
    start = CampaignState(found.start.flights, tuple(np.array([JITTER_S]) for _ in tasks))
    fit = fit_campaign(there, start, model)
    scales = there.kind.noise_scales(there, fit.equations)
    assert scales is not None
    assert np.sqrt(np.mean(scales**2)) == pytest.approx(1.0, abs=0.06)


def test_the_gradient_is_that_of_the_cost_that_steps_have_to_lower() -> None:
    """With rows shifted by many standard deviations, and some far off across the motion."""
    found = shaken(Hidden(), LONG, seed=11)
    tasks = list(found.campaign.sequences)
    x = tasks[0].x_world.copy()
    x[::9] += 12.0 * LONG.sigma_x
    tasks[0] = replace(tasks[0], x_world=x)
    there, model, theta = replace(found.campaign, sequences=tuple(tasks)), Model((MODELS["trigger_jitter"],)), np.array([JITTER_S])
    kind, flight = there.kind, found.start.flights[0]
    at = kind.residuals(there, 0, flight, model, theta)
    g = kind.equations(there, 0, at, model, theta).g
    assert (np.abs(at.e) > HUBER).any()
    for column in (*range(3, 6), *range(9, 12)):
        step = np.zeros(N_PARAMETERS)
        step[column] = 1e-6
        up, down = (kind.cost(tasks[0], kind.residuals(there, 0, moved(flight, each), model, theta)) for each in (step, -step))
        assert (up - down) / 2e-6 == pytest.approx(g[column], rel=1e-3, abs=1e-3 * np.abs(g).max())


def test_random_times_far_beyond_the_noise_settle_and_their_size_has_an_interval() -> None:
    """A film of a variable rate: rows are off by ten times the noise along the motion."""
    found = shaken(Hidden(), replace(LONG, sigma_x=2e-4), seed=5)
    there, fit = fit_with(found.campaign, found.start, [MODELS["trigger_jitter"]])
    (value,) = effect_values(replace(found, campaign=there), fit, campaign_covariance(there, fit))
    assert fit.settled
    assert value.value == pytest.approx(JITTER_S, abs=3.0 * value.sigma)
    assert 0.01 * JITTER_S < value.sigma < 0.1 * JITTER_S


def test_random_times_that_are_not_there_have_an_upper_bound() -> None:
    """At zero: the data say how large they may be."""
    found = register_trajectories(campaign(1, Hidden(), Tracker(rows=30, orientation=False), sequences=3))
    there, fit = fit_with(found.campaign, found.start, [MODELS["trigger_jitter"]])
    (value,) = effect_values(replace(found, campaign=there), fit, campaign_covariance(there, fit))
    assert value.value == 0.0
    assert 1e-5 < value.sigma < 1e-3
