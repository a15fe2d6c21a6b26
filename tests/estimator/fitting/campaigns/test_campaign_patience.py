"""A fit of a campaign ends where steps gain nothing any more, at the best of what it saw."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting import descent
from estimator.fitting.campaigns import campaign
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign, sequence_equations
from estimator.fitting.descent import Descended, Effort, descended
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.system import Arrangement, System
from estimator.motion.rigid_body import RanAway
from tests.estimator.small_campaign import fitted, registered


class Given:
    """A problem whose every step is large and whose costs are given."""

    def __init__(self, costs: list[float]) -> None:
        self.costs = iter(costs)
        self.asked = 0

    def moved(self, state: int, _: np.ndarray) -> int:
        return state + 1

    def tried(self, _: int, _most: float) -> Callable[[], System[Any]]:
        cost = next(self.costs)
        self.asked += 1
        told, known = SimpleNamespace(H=np.eye(1), g=np.full(1, 40.0)), NormalEquations(np.zeros((1, 1)), np.zeros(1), 0.0)
        return lambda: System((told,), Arrangement((np.zeros(1, dtype=np.int64),), 1), known, cost)


def fit_with_costs(costs: list[float]) -> tuple[Descended[int, Any], int]:
    """A fit with these costs, and how many of them it asked for."""
    problem = Given(costs)
    return descended(problem, 0), problem.asked


def test_a_fit_that_wanders_ends_where_it_was_best() -> None:
    found, asked = fit_with_costs([100.0, 50.0, *(50.001 + 0.001 * i for i in range(40))])
    assert (found.system.cost, found.state, found.settled) == (50.0, 1, False)
    assert asked == 2 + descent.PATIENCE


def test_a_fit_that_still_gains_goes_on() -> None:
    found, asked = fit_with_costs([200.0 - i for i in range(40)])
    assert asked == 1 + descent.MOST_STEPS
    assert found.system.cost == 200.0 - descent.MOST_STEPS


def test_a_fit_that_falls_fast_takes_more_steps_than_its_own() -> None:
    """As far as it falls, and no further than a bound."""
    fast, slow = 1.0 - 2.0 * descent.FALLING, 1.0 - 0.5 * descent.FALLING
    costs = [4000.0 * fast**i for i in range(26)]
    found, asked = fit_with_costs([*costs, *(costs[-1] * slow**i for i in range(1, 40))])
    assert asked == 1 + 25 + 1
    assert found.system.cost == pytest.approx(costs[-1] * slow)
    _, asked = fit_with_costs([4000.0 * fast**i for i in range(80)])
    assert asked == 1 + descent.MOST_FALLING


def test_a_fit_that_creeps_goes_on() -> None:
    """Each step gains less than counts, but two of them together do."""
    _, asked = fit_with_costs([4000.0 * (1.0 - 0.6 * descent.STILL_SHARE) ** i for i in range(40)])
    assert asked == 1 + descent.MOST_STEPS


def test_a_step_that_raises_the_cost_is_not_linearised(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor is more of it looked at than shows it; one that lowers the cost is what the equations of its state are."""
    observed, start = registered().campaign, fitted()
    away = CampaignState(tuple(replace(f, omega=1.3 * f.omega) for f in start.state.flights), start.state.theta)
    begun = fit_campaign(observed, away, start.model, Effort(0, 0))
    lower = fit_campaign(observed, begun.state, start.model, Effort(1, 1))
    assert lower.cost < begun.cost
    for number, each in enumerate(lower.equations):
        np.testing.assert_array_equal(each.frames.H, sequence_equations(observed, number, lower.state, begun.model).frames.H)
    looked_at: list[int] = []
    made, linearised = campaign._residuals, campaign._equations

    def turned(*args: Any) -> campaign.SequenceEquations:
        """With steps that lead up."""
        each = linearised(*args)
        return replace(each, frames=replace(each.frames, g=-each.frames.g))

    monkeypatch.setattr(campaign, "_residuals", lambda each, number, *at: looked_at.append(number) or made(each, number, *at))
    monkeypatch.setattr(campaign, "_equations", turned)
    assert fit_campaign(observed, begun.state, start.model).cost == begun.cost
    assert looked_at.count(0) == 1 + descent.HALVINGS
    assert looked_at.count(1) < 1 + descent.HALVINGS


def test_flights_of_which_nothing_is_seen_are_no_start() -> None:
    """Behind the camera, with a magnification that mirrors them back into the picture, no tangency is left: they would cost nothing."""
    observed, start = registered().campaign, fitted()
    model = Model((*start.model.effects, MODELS["focal_length"]))
    flights = tuple(replace(flight, x=-flight.x) for flight in start.state.flights)
    mirrored = CampaignState(flights, tuple(np.append(theta, -2.0) for theta in start.state.theta))
    with pytest.raises(RanAway, match="nothing is seen"):
        fit_campaign(observed, mirrored, model)
