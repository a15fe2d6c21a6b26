"""A spin that is read once in a flight may be wrong: lift is then told by the others, and as sure as before where all are right."""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from estimator.diagnosis.diagnose import diagnosis_at
from estimator.diagnosis.explain import Explanation
from estimator.diagnosis.selection.names import left_out
from estimator.motion.flight import N_PARAMETERS
from tests.estimator.made_balls import DRAG_OF_LIFT, LIFT, explained_balls

pytestmark = pytest.mark.long

NUMBER, WRONG = 15, 3
LIFTS = ("magnus_lift", "quadratic_drag")


@cache
def found(wrong: int, tried: Sequence[str], *, drags: bool = False) -> Explanation:
    return explained_balls(NUMBER, wrong, tried, drags=drags)


def lift(of: Explanation) -> tuple[float, float]:
    """The fitted coefficient and its standard deviation."""
    place = of.fit.model.slices[of.fit.model.keys.index("magnus_lift")].start
    variance = of.covariance.of(0, np.array([N_PARAMETERS + place]))
    return float(of.fit.state.theta[0][place]), float(np.sqrt(variance[0, 0]))


def test_where_all_readings_are_right_lift_is_as_it_was_without_that_noise() -> None:
    value, sigma = lift(found(0, (*LIFTS, "unmeasured_lift")))
    expected, before = lift(found(0, LIFTS))
    assert found(0, (*LIFTS, "unmeasured_lift")).found == ("magnus_lift",)
    assert value == pytest.approx(expected, rel=0.02)
    assert sigma == pytest.approx(before, rel=0.1)


def test_where_some_readings_are_of_other_balls_lift_is_that_of_the_right_ones() -> None:
    told = found(WRONG, (*LIFTS, "unmeasured_lift"))
    assert told.found == ("magnus_lift",)
    assert abs(lift(told)[0] - LIFT) < 0.05 * LIFT
    assert [task.misread for task in told.campaign.sequences] == [number < WRONG for number in range(NUMBER)]


def test_drag_that_grows_with_spin_is_told_as_such_though_some_spins_were_misread() -> None:
    """Lift tells the drag of a misread spin, too: it is no push of every flight, and no distortion."""
    own = "unmeasured_lift", "unmeasured_drag", "uniform_acceleration"
    told = found(WRONG, (*LIFTS, "induced_drag", *own, "position_distortion"), drags=True)
    assert set(told.found) == {"magnus_lift", "quadratic_drag", "induced_drag"}
    assert abs(lift(told)[0] - LIFT) < 0.05 * LIFT
    place = told.fit.model.slices[told.fit.model.keys.index("induced_drag")].start
    assert abs(float(told.fit.state.theta[0][place]) - DRAG_OF_LIFT) < 0.1 * DRAG_OF_LIFT


@pytest.mark.parametrize("wrong", [4, 6])
def test_where_most_readings_are_wrong_balls_are_lifted_all_the_same(wrong: int) -> None:
    """Nothing but a lift by the spin makes a wrong reading of it matter."""
    told = explained_balls(8, wrong, (*LIFTS, "unmeasured_lift", "uniform_acceleration"))
    assert told.found == ("magnus_lift",)
    assert told.noise == ("unmeasured_lift",)


def test_without_an_effect_that_acts_by_the_spin_a_wrong_reading_does_nothing() -> None:
    told = explained_balls(8, 0, ("quadratic_drag", "unmeasured_lift", "uniform_acceleration"))
    assert "unmeasured_lift" not in told.fit.model.keys
    assert "unmeasured_lift" not in {each.key for each in left_out(told.path[-1], told.fit.model.keys)}
    assert "unmeasured_lift" not in {finding.key for at in (told.begun, told.last) for finding in diagnosis_at(at).findings}
