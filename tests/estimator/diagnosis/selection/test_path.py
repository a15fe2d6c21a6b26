"""Campaigns with a mess: what is hidden is found with its size, one bad flight changes nothing, and the mess alone is no effect."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.motion.flight import N_PARAMETERS
from tests.estimator.diagnosis.selection.messy_campaign import BAD, STAMP_S, registered
from tests.estimator.made_trajectories import Hidden

pytestmark = pytest.mark.long

DRAG = 0.3
FALLING = Hidden(drag=DRAG)
BOTH = Hidden(drag=0.2, more_gravity=0.6)
SEEDS = (2, 3)
OF_THE_MESS = {"stamp_scatter", "trigger_jitter", "uniform_acceleration"}
"""What rounded stamps and pushes of every flight are."""


def explained(seed: int, hidden: Hidden, *, bad: bool = True) -> Explanation:
    return _explained(seed, hidden, bad)


@cache
def _explained(seed: int, hidden: Hidden, bad: bool) -> Explanation:
    made = registered(seed, hidden, bad=bad)
    return explain(made.campaign, made.start, catalogue())


def value_of(found: Explanation, key: str) -> tuple[float, float]:
    """First parameter of an effect that all flights share, with its standard deviation."""
    part = found.fit.model.slices[found.fit.model.keys.index(key)]
    return float(found.fit.state.theta[0][part][0]), float(np.sqrt(found.covariance.of(0, np.array([N_PARAMETERS + part.start]))[0, 0]))


@pytest.mark.parametrize("seed", SEEDS)
def test_drag_is_found_first_with_its_size(seed: int) -> None:
    found = explained(seed, FALLING)
    first = found.steps[0]
    assert first.added == "quadratic_drag"
    assert set(first.group) <= {"quadratic_drag", "linear_drag", "steady_wind"}
    assert set(found.found) <= {"quadratic_drag", *OF_THE_MESS}
    assert first.worth > np.log(20.0)
    value, sigma = value_of(found, "quadratic_drag")
    assert abs(value - DRAG) < 4.0 * sigma
    assert sigma < 0.2 * DRAG
    assert not found.left.present


@pytest.mark.parametrize("seed", SEEDS)
def test_one_bad_flight_changes_nothing(seed: int) -> None:
    """It is given a noise of its own, not a part in what was found."""
    with_it, without = (explained(seed, FALLING, bad=bad) for bad in (True, False))
    assert set(with_it.found) - OF_THE_MESS == set(without.found) - OF_THE_MESS == {"quadratic_drag"}
    (value, sigma), (other, _) = (value_of(each, "quadratic_drag") for each in (with_it, without))
    assert abs(value - other) < 2.0 * sigma
    noise = [task.noise for task in with_it.campaign.sequences]
    assert noise[BAD] > 1.3 * np.median(noise)


@pytest.mark.parametrize("seed", [2, 3, 6])
def test_the_mess_alone_is_no_effect(seed: int) -> None:
    """Time stamps that were rounded may be found, as what they are."""
    found = explained(seed, Hidden())
    assert set(found.found) <= OF_THE_MESS
    if "trigger_jitter" in found.found:
        assert value_of(found, "trigger_jitter")[0] == pytest.approx(STAMP_S / np.sqrt(12.0), rel=0.3)
    assert not found.left.present


def test_two_effects_at_once_are_both_found() -> None:
    """A gravity is one number with a frame rate and a scale of lengths."""
    found = explained(2, BOTH)
    groups = [set(step.group) for step in found.steps if step.added not in OF_THE_MESS]
    assert len(groups) == 2
    assert any("quadratic_drag" in group for group in groups)
    assert any({"gravity", "frame_rate"} <= group for group in groups)
    assert set(found.found) <= {"quadratic_drag", "linear_drag", "gravity", "frame_rate", "length_scale", *OF_THE_MESS}
    for key, true in (("quadratic_drag", 0.2), ("frame_rate", 1.0 / np.sqrt(1.0 + 0.6 / 9.81) - 1.0)):
        if key in found.found:
            value, sigma = value_of(found, key)
            assert abs(value - true) < 4.0 * sigma


def test_every_set_on_the_path_is_more_probable_than_the_one_before() -> None:
    found = explained(2, BOTH)
    assert found.path[0] is found.begun
    assert found.begun.keys == ()
    # Noise is read again about what was found: values of two entries are of one noise only beside the later one.
    assert all(after.value > after.value_of(before.keys) for before, after in pairwise(found.path))
    assert len({frozenset(each.keys) for each in found.path}) == len(found.path)
    assert set(found.last.keys) == set(found.found)
    assert set(found.path[-1].keys) == set(found.path[-1].named(found.path[-1].posterior.best))


def test_steps_are_told_by_what_they_are_worth_with_held_out_errors_beside() -> None:
    found = explained(2, BOTH)
    worth = [step.worth for step in found.steps]
    assert worth == sorted(worth, reverse=True)
    assert all(before.after is after.before for before, after in pairwise(found.rungs))
    assert found.rungs[-1].after.rms_px < found.rungs[0].before.rms_px
    assert found.held_out.rms_px == found.rungs[-1].after.rms_px
    assert [len(step.fit.model.keys) for step in found.rungs] == list(range(1, len(found.rungs) + 1))
    reached = [next(i for i, at in enumerate(found.path) if step.added in at.keys) for step in found.rungs]
    assert reached == sorted(reached)
    assert all(0.5 < step.probability <= 1.0 for step in found.steps)
    assert all(step.group[0] == step.added and step.odds[0] == 0.0 for step in found.steps)
