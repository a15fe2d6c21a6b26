"""What is hidden in field campaigns is drawn from a seed, above its limit in that campaign, beside a mess below it."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from tumble.challenge.field_case import CHANNELS, TRAJECTORIES, FieldCase, case_from_dict
from tumble.challenge.field_drawing import HIDDEN, MOST_HIDDEN, OUTSIDE_SHARE, OVER_LIMIT, PUSH, STRAY, FieldPlan, draw_field_case, reach
from tumble.challenge.field_limits import FOUND, known, left_at_limit, left_of, limit_along
from tumble.challenge.limits import noncentrality

PLAN = FieldPlan(400, (1, 4), (8, 20), TRAJECTORIES)
SEED, COUNT = 7, 14


@pytest.fixture(scope="module")
def cases() -> list[FieldCase]:
    return [draw_field_case(PLAN, SEED, number) for number in range(COUNT)]


def test_a_seed_draws_the_same_campaign_and_another_number_another_one(cases: list[FieldCase]) -> None:
    assert draw_field_case(PLAN, SEED, 2) == cases[2]
    assert len({case.seed for case in cases}) == COUNT


def test_flights_and_sizes_are_inside_their_ranges(cases: list[FieldCase]) -> None:
    for case in cases:
        assert 1 <= len(case.flights) <= 4
        assert all(8 <= flight.rows <= 20 for flight in case.flights)
        assert len(case.hidden) <= MOST_HIDDEN
        assert set(case.hidden) <= set(HIDDEN)
        assert not (case.hidden and case.outside)
        assert all(OVER_LIMIT[0] <= over <= OVER_LIMIT[1] for over in case.over_limit.values())
        assert set(case.over_limit) == {*case.hidden, *case.outside}
        assert set(case.noise.sigma) == set(CHANNELS[case.measured])
    assert {len(case.hidden) for case in cases} >= {0, 1, 2}
    assert len({case.measured for case in cases}) == 4


def test_the_mess_is_always_there_and_below_its_limits(cases: list[FieldCase]) -> None:
    for case in cases:
        assert case.mess
        assert all(over <= PUSH * (1 + 1e-9) for over in case.mess_over_limit.values())
        assert any(over <= STRAY * (1 + 1e-9) for over in case.mess_over_limit.values()) or case.measured == "positions"
        assert case.noise.repeats in (2, 3)
        assert 0.01 <= case.noise.outliers <= 0.02
        assert case.noise.rounded == (case.flights[0].rate_hz <= 250.0)


def test_limits_are_those_of_the_information_of_the_very_campaign(cases: list[FieldCase]) -> None:
    case = next(each for each in cases if len(each.hidden) == 1 and "uniform_acceleration" not in each.hidden)
    ((key, values),) = case.hidden.items()
    of = known(case)
    sizes = np.array([[column[0] for column in values.values()]])
    assert limit_along(of, key, sizes) * case.over_limit[key] == pytest.approx(1.0)
    assert reach(of, key, sizes) >= 1.0
    rows = of.of.rows(of.of.keys.index(key))
    strength = float(sizes[0] @ of.of.information[np.ix_(rows, rows)] @ sizes[0]) / case.over_limit[key] ** 2
    assert strength == pytest.approx(noncentrality(of.level, len(rows), FOUND))


def test_about_one_in_ten_has_a_force_that_the_catalogue_lacks() -> None:
    drawn = [np.random.default_rng([SEED, number]).random() < OUTSIDE_SHARE for number in range(COUNT)]
    number = next(n for n in range(1000) if np.random.default_rng([SEED, n]).random() < OUTSIDE_SHARE)
    case = draw_field_case(FieldPlan(1000, (2, 4), (10, 20), TRAJECTORIES), SEED, number)
    assert any(drawn) == (number < COUNT)
    assert list(case.outside) in (["wall_attraction"], ["outgassing_thrust"])
    assert not case.hidden
    ((key, over),) = case.over_limit.items()
    # What the best effect that flights share leaves of it would be found, and that grows with the square of its size.
    left = left_of(known(case), replace(case, mess={}))
    assert left > 0.5 * over**2 * left_at_limit(known(case)), key


def test_a_case_comes_back_from_its_file(cases: list[FieldCase]) -> None:
    for case in cases:
        assert case_from_dict(json.loads(json.dumps(asdict(case)))) == case
