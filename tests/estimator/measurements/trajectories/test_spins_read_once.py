"""A spin that is read once in a flight may be wrong: lift is then told by the others, and as sure as before where all are right."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from datasets.trajectory import Trajectory
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.motion.flight import N_PARAMETERS
from tests.estimator.made_trajectories import GRAVITY, RATE_HZ, Hidden, Tracker, measured

Array = np.ndarray
BALL = Tracker(rows=40, sigma_x=1e-3, orientation=False, spin=True, stated=True)
LIFT, SPIN_RADS, SIGMA_RADS, NUMBER, WRONG = 2e-3, 200.0, 4.0, 15, 3
DRAG, DRAG_OF_LIFT = 0.15, 0.3
"""Of a table tennis ball: over the square of its speed (1/m), and over lift."""
LIFTS = ("magnus_lift", "quadratic_drag")


def spin(rng: np.random.Generator) -> Array:
    """A spin across the flight, forth or back, with a part of its own along every axis."""
    return np.array([0.0, rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5) * SPIN_RADS, 0.0]) + rng.normal(0.0, 40.0, 3)


def pushed(omega: Array, v: Array, *, drags: bool) -> Array:
    """Acceleration by gravity and lift; ``drags``: by drag, too, which grows with the spin."""
    lift, speed = LIFT * np.cross(omega, v), np.linalg.norm(v)
    return np.asarray(GRAVITY + lift - drags * (DRAG * speed + DRAG_OF_LIFT * np.linalg.norm(lift) / speed) * v)


def ball(rng: np.random.Generator, name: str, *, wrong: bool, drags: bool) -> Trajectory:
    """A ball in explicit steps of a tenth of a row; where ``wrong``, its reading is that of another ball."""
    x, v, omega, step = np.zeros(3), np.array([8.0, 0.0, 1.0]) + rng.normal(0.0, 0.5, 3), spin(rng), 0.1 / RATE_HZ
    other, seen = spin(rng), [x]
    for _ in range(BALL.rows - 1):
        for _ in range(10):
            half = v + 0.5 * step * pushed(omega, v, drags=drags)
            x, v = x + step * half, v + step * pushed(omega, half, drags=drags)
        seen.append(x)
    made, read = measured(name, rng, Hidden(), BALL), np.full((BALL.rows, 3), np.nan)
    read[BALL.rows // 2] = (other if wrong else omega) + rng.normal(0.0, SIGMA_RADS, 3)
    x_world = np.array(seen) + rng.normal(0.0, BALL.sigma_x, (BALL.rows, 3))
    return replace(made, x_world=x_world, omega_world=read, sigma_omega=read * 0.0 + SIGMA_RADS)


@cache
def found(wrong: int, tried: Sequence[str], seed: int = 7, *, drags: bool = False) -> Explanation:
    rng = np.random.default_rng(seed)
    registered = register_trajectories([ball(rng, f"shot_{i}", wrong=i < wrong, drags=drags) for i in range(NUMBER)])
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in tried})


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
    part = told.fit.model.slices[told.fit.model.keys.index("unmeasured_lift")]
    own = np.array([np.linalg.norm(theta[part]) for theta in told.fit.state.theta])
    assert set(np.argsort(own)[-WRONG:]) == set(range(WRONG))


def test_drag_that_grows_with_spin_is_told_as_such_though_some_spins_were_misread() -> None:
    """Lift tells the drag of a misread spin, too: it is no push of every flight, and no distortion."""
    own = "unmeasured_lift", "unmeasured_drag", "uniform_acceleration"
    told = found(WRONG, (*LIFTS, "induced_drag", *own, "position_distortion"), drags=True)
    assert set(told.found) == {"magnus_lift", "quadratic_drag", "induced_drag"}
    assert abs(lift(told)[0] - LIFT) < 0.05 * LIFT
    place = told.fit.model.slices[told.fit.model.keys.index("induced_drag")].start
    assert abs(float(told.fit.state.theta[0][place]) - DRAG_OF_LIFT) < 0.1 * DRAG_OF_LIFT
