"""A free flight that misses by far is looked at once more for impacts; one that fits is left as it is."""

from dataclasses import replace
from typing import Any

import pytest

from estimator.data.configuration import Configuration
from estimator.impacts.chains import WEAK_RATIO, Seen
from estimator.impacts.impact_search import LEAST_RATIO
from estimator.measurements.silhouettes import registration
from estimator.measurements.silhouettes.flights_of_drops import FreeFlight
from tests.estimator.small_campaign import observations, registered


@pytest.mark.parametrize(
    ("cost", "asked", "flights"), [(1.0, [LEAST_RATIO], 1), (2.0 * registration.HOPELESS_COST, [LEAST_RATIO, WEAK_RATIO], 2)]
)
def test_weak_kinks_are_tried_where_a_free_flight_is_hopeless(
    monkeypatch: pytest.MonkeyPatch, cost: float, asked: list[float], flights: int
) -> None:
    found, ratios = registered(), []
    task, flight = found.campaign.sequences[0].task, found.start.flights[0]

    def free_flights_of(*_: Any, least_ratio: float = LEAST_RATIO) -> tuple[FreeFlight, ...]:
        ratios.append(least_ratio)
        return tuple(FreeFlight(k, task, flight) for k in (1, 2)) if least_ratio < LEAST_RATIO else ()

    def candidate_flights(*given: Any) -> list[Any]:
        (best, *_) = real(*given)
        solution = best.solution
        equations = replace(solution.equations, cost=cost * given[1].weight.size)
        return [replace(best, solution=replace(solution, equations=equations))]

    real = registration.candidate_flights
    monkeypatch.setattr(registration, "free_flights_of", free_flights_of)
    monkeypatch.setattr(registration, "candidate_flights", candidate_flights)
    seen = Seen(observations()[0], (), found.particles[0])
    made = registration._flown(seen, task, task.views, Configuration())
    assert ratios == asked
    assert len(made) == flights
    assert made[0].number == (1 if flights == 2 else 0)
