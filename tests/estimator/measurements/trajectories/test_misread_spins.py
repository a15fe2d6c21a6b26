"""Spins that were read once, of another flight, are set aside once a lift by the spin is found, and told."""

from functools import cache

import numpy as np

from estimator.diagnosis.adding import ladder
from estimator.diagnosis.explain import Explanation
from estimator.diagnosis.selection.refitting import held_anew
from estimator.effects.choosing import catalogue
from estimator.motion.flight import OMEGA
from tests.estimator.made_balls import LIFT, explained_balls, registered_balls
from tumble.scattering import scattered

NUMBER, WRONG = 15, 6


@cache
def found(wrong: int) -> Explanation:
    return explained_balls(NUMBER, wrong, ("magnus_lift", "saturating_lift", "unmeasured_lift"))


def misread(of: Explanation) -> set[int]:
    return {number for number, task in enumerate(of.campaign.sequences) if task.misread}


def test_readings_of_other_balls_are_set_aside_and_count_as_none() -> None:
    told = found(WRONG)
    assert told.found == ("magnus_lift",)
    assert misread(told) <= set(range(WRONG))
    assert len(misread(told)) >= WRONG - 2
    for number in misread(told):
        task = told.campaign.sequences[number]
        assert not task.seen("omega").any()
        assert task.still[OMEGA].all()
        assert np.isin(np.r_[OMEGA], told.campaign.kind.unmeasured(task)).all()
        assert not told.fit.state.flights[number].omega.any()


def test_their_flights_have_a_lift_of_which_nothing_is_known_and_others_have_none() -> None:
    told = found(WRONG)
    part = told.fit.model.slices[told.fit.model.keys.index("unread_lift")]
    lifts = np.array([np.linalg.norm(theta[part]) for theta in told.fit.state.theta])
    aside = np.array([task.misread for task in told.campaign.sequences])
    assert lifts[aside].min() > 0.1
    assert lifts[~aside].max() < 1e-6


def test_their_flights_are_told_by_name() -> None:
    told = found(WRONG)
    (sentence,) = scattered(told)
    assert all(told.campaign.sequences[number].name in sentence for number in misread(told))


def test_the_lift_is_that_of_the_right_ones() -> None:
    told = found(WRONG)
    value = told.fit.state.theta[0][told.fit.model.slices[told.fit.model.keys.index("magnus_lift")]]
    assert abs(float(value[0]) - LIFT) < 0.02 * LIFT


def test_what_other_readings_are_wrong_by_is_as_probable_beside_those_that_are_left() -> None:
    """With readings of other balls it was far larger, and so were lifts beside those by right ones."""
    last = found(WRONG).last
    assert held_anew(last.campaign, last.fit)[1] is last.fit


def test_right_readings_are_all_kept() -> None:
    assert not misread(found(0))


def test_a_ladder_that_begins_with_the_noise_of_readings_ends_where_explain_does() -> None:
    """Nothing acts by the spin on its first rung: what did nothing there is asked for again with every other effect."""
    registered, asked = registered_balls(NUMBER, WRONG), ("unmeasured_lift", "magnus_lift")
    last = list(ladder(registered.campaign, registered.start, [catalogue()[key] for key in asked]))[-1]
    assert set(last.fit.model.keys) == {"unread_lift", *asked}
    assert {task.name for task in last.campaign.sequences if task.misread} == {f"shot_{i}" for i in misread(found(WRONG))}
    value = last.fit.state.theta[0][last.fit.model.slices[last.fit.model.keys.index("magnus_lift")]]
    assert abs(float(value[0]) - LIFT) < 0.02 * LIFT
