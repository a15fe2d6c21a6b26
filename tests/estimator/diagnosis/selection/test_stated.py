"""Facts in the evidence: what the data alone cannot tell apart, a stated number does."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.selection.groups import group_of
from estimator.diagnosis.selection.names import key_of
from estimator.diagnosis.selection.path import At, looked_at
from estimator.diagnosis.selection.stated import with_facts
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.facts import Fact
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, campaign

SCALES = ("frame_rate", "length_scale", "gravity")
LENGTH = Fact("length", (("length_scale", (1.0,)),), -0.02, 0.002)
CLOCK = Fact("clock", (("frame_rate", (1.0,)),), 0.0, 1e-5)
GRAVITY = Fact("gravity", (("gravity", (0.0, 0.0, -1.0)),), 0.2, 0.01)


@pytest.fixture(scope="module")
def tosses() -> Registered:
    """Four flights that fall 2% too fast: gravity, lengths or clock."""
    return register_trajectories(campaign(5, Hidden(more_gravity=0.2), Tracker(rows=25, orientation=False)))


def seen(tosses: Registered, *facts: Fact) -> At:
    known = {key: effect for key, effect in catalogue().items() if key in SCALES}
    at = replace(tosses.campaign, facts=facts)
    return looked_at(at, base_fit(at, tosses.start), known)


def names(at: At) -> tuple[str, ...]:
    best = at.posterior.best
    return tuple(key_of(at, name) for name in group_of(at.trial, best, best[0]))


def test_without_a_fact_it_is_one_number_with_three_names(tosses: Registered) -> None:
    assert set(names(seen(tosses))) == set(SCALES)


@pytest.mark.parametrize(("fact", "left"), [(LENGTH, ("length_scale",)), (GRAVITY, ("gravity",))])
def test_a_fact_settles_the_group(tosses: Registered, fact: Fact, left: tuple[str, ...]) -> None:
    assert names(seen(tosses, fact)) == left


def test_a_checked_clock_is_out_of_the_group(tosses: Registered) -> None:
    assert set(names(seen(tosses, CLOCK))) == {"length_scale", "gravity"}


def test_the_quadratic_has_the_misfit_of_the_fact(tosses: Registered) -> None:
    bare, with_fact = seen(tosses).trial.evidence.of, seen(tosses, LENGTH).trial.evidence.of
    theta = np.zeros(len(bare.columns))
    (row,) = bare.rows(bare.keys.index("length_scale"))
    for value in (0.0, -0.03):
        theta[row] = value
        added = _squares(with_fact, theta) - _squares(bare, theta)
        assert added == pytest.approx(((value - LENGTH.value) / LENGTH.sigma) ** 2, rel=1e-6, abs=1e-6)


def _squares(of: object, theta: np.ndarray) -> float:
    return float(of.misfit - 2.0 * of.pull @ theta + theta @ of.information @ theta)  # type: ignore[attr-defined]


def test_where_the_noise_is_known_up_to_a_factor_a_fact_is_one_number_more(tosses: Registered) -> None:
    bare = replace(seen(tosses).trial.evidence.of, count=12.0)
    assert with_facts(bare, tosses.campaign) is bare
    assert with_facts(bare, replace(tosses.campaign, facts=(LENGTH, CLOCK))).count == 14.0
