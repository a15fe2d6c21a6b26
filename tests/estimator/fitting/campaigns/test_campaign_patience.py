"""A fit of a campaign ends where steps gain nothing any more, at the best of what it saw."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns import campaign
from estimator.fitting.campaigns.campaign import (
    PATIENCE,
    CampaignFit,
    CampaignState,
    fit_campaign,
    sequence_equations,
    shared_prior,
    solve_arrow,
)
from estimator.motion.rigid_body import RanAway
from tests.estimator.small_campaign import fitted, registered


def fit_with_costs(costs: list[float], monkeypatch: pytest.MonkeyPatch) -> tuple[CampaignFit, int]:
    """A fit whose every step is large and whose costs are given, and how many of them it asked for."""
    observed, start = registered().campaign, fitted()
    left = iter(costs)
    looked_at = campaign._no_dearer
    monkeypatch.setattr(campaign, "_cost", lambda *_: next(left))
    monkeypatch.setattr(campaign, "_no_dearer", lambda each, state, model, _: looked_at(each, state, model, np.inf))
    monkeypatch.setattr(campaign, "_relative_size", lambda *_: 40.0)
    found = fit_campaign(observed, start.state, start.model)
    return found, len(costs) - len(list(left))


def test_a_fit_that_wanders_ends_where_it_was_best(monkeypatch: pytest.MonkeyPatch) -> None:
    found, asked = fit_with_costs([100.0, 50.0, *(50.001 + 0.001 * i for i in range(40))], monkeypatch)
    assert (found.cost, found.settled) == (50.0, False)
    assert asked == 2 + PATIENCE


def test_a_fit_that_still_gains_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    found, asked = fit_with_costs([200.0 - i for i in range(40)], monkeypatch)
    assert asked == 1 + campaign.MOST_STEPS
    assert found.cost == 200.0 - campaign.MOST_STEPS


def test_a_fit_that_falls_fast_takes_more_steps_than_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """As far as it falls, and no further than a bound."""
    fast, slow = 1.0 - 2.0 * campaign.FALLING, 1.0 - 0.5 * campaign.FALLING
    costs = [4000.0 * fast**i for i in range(26)]
    found, asked = fit_with_costs([*costs, *(costs[-1] * slow**i for i in range(1, 40))], monkeypatch)
    assert asked == 1 + 25 + 1
    assert found.cost == pytest.approx(costs[-1] * slow)
    _, asked = fit_with_costs([4000.0 * fast**i for i in range(80)], monkeypatch)
    assert asked == 1 + campaign.MOST_FALLING


def test_a_fit_that_creeps_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each step gains less than counts, but two of them together do."""
    _, asked = fit_with_costs([4000.0 * (1.0 - 0.6 * campaign.STILL_SHARE) ** i for i in range(40)], monkeypatch)
    assert asked == 1 + campaign.MOST_STEPS


def test_a_step_that_raises_the_cost_is_not_linearised(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor is more of it looked at than shows it; one that lowers the cost is what the equations of its state are."""
    observed, start = registered().campaign, fitted()
    away = CampaignState(tuple(replace(f, omega=1.3 * f.omega) for f in start.state.flights), start.state.theta)
    begun = fit_campaign(observed, away, start.model, most_steps=0, most_falling=0)
    solution = solve_arrow(begun.equations, begun.layout, shared_prior(observed, begun.layout, begun.model, begun.state))
    at, kind = (begun.cost, begun.state, begun.equations), (begun.layout, begun.model)
    lower = campaign._lowered(observed, kind, at, solution, ())
    assert lower is not None
    (cost, state, equations), _ = lower
    assert cost < begun.cost
    for number, each in enumerate(equations):
        np.testing.assert_array_equal(each.frames.H, sequence_equations(observed, number, state, begun.model).frames.H)
    looked_at: list[int] = []
    made = campaign._residuals
    monkeypatch.setattr(campaign, "_residuals", lambda each, number, *at: looked_at.append(number) or made(each, number, *at))
    monkeypatch.setattr(campaign, "_equations", None)
    backwards = replace(solution, local=tuple(-each for each in solution.local), shared=-solution.shared)
    assert campaign._lowered(observed, kind, at, backwards, ()) is None
    assert looked_at.count(0) == campaign.HALVINGS
    assert looked_at.count(1) < campaign.HALVINGS


def test_flights_of_which_nothing_is_seen_are_no_start() -> None:
    """Behind the camera, with a magnification that mirrors them back into the picture, no tangency is left: they would cost nothing."""
    observed, start = registered().campaign, fitted()
    model = Model((*start.model.effects, MODELS["focal_length"]))
    flights = tuple(replace(flight, x=-flight.x) for flight in start.state.flights)
    mirrored = CampaignState(flights, tuple(np.append(theta, -2.0) for theta in start.state.theta))
    with pytest.raises(RanAway, match="nothing is seen"):
        fit_campaign(observed, mirrored, model)
