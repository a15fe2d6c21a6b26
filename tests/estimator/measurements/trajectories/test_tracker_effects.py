"""A distorted volume and lift of spins that nobody measured: found where they are, not called drag, and not found where they are not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from datasets.trajectory import Trajectory
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import GRAVITY, RATE_HZ, Hidden, Tracker, measured

Array = np.ndarray
TRIED = ("position_distortion", "quadratic_drag", "linear_drag", "unmeasured_lift", "uniform_acceleration", "length_scale")
K, DRAG = 0.01, 0.3
TRACKER = Tracker(rows=40, sigma_x=3e-4, orientation=False, stated=True)
BALL = Tracker(rows=40, sigma_x=5e-4, orientation=False, spin=True, stated=True)
LIFT, NUMBER, WRONG = 2.5e-3, 8, (3, 6)


def distorted(trajectories: list[Trajectory], k: float) -> list[Trajectory]:
    """What a tracker reports that stretches the volume towards its edge."""
    places = np.concatenate([t.x_world for t in trajectories])
    middle = places.mean(axis=0)
    squares = np.mean(np.sum((places - middle) ** 2, axis=1))

    def seen(x: Array) -> Array:
        away = x - middle
        return x + k * np.sum(away**2, axis=1, keepdims=True) / squares * away

    return [replace(t, x_world=seen(t.x_world)) for t in trajectories]


def found_in(trajectories: list[Trajectory]) -> Explanation:
    registered = register_trajectories(trajectories)
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})


@cache
def tracked(k: float, drag: float) -> Explanation:
    rng = np.random.default_rng(11)
    return found_in(distorted([measured(f"toss_{i}", rng, Hidden(drag=drag), TRACKER) for i in range(NUMBER)], k))


def value_of(found: Explanation, key: str) -> float:
    return float(found.fit.state.theta[0][found.fit.model.slices[found.fit.model.keys.index(key)]][0])


def test_a_hidden_distortion_is_found_and_not_called_drag() -> None:
    found = tracked(K, 0.0)
    assert found.found == ("position_distortion",)
    assert abs(value_of(found, "position_distortion") - K) < 0.2 * K


def test_a_hidden_drag_is_found_and_not_called_distortion() -> None:
    found = tracked(0.0, DRAG)
    assert found.found == ("quadratic_drag",)
    assert abs(value_of(found, "quadratic_drag") - DRAG) < 0.2 * DRAG


def test_where_neither_is_neither_is_found() -> None:
    assert tracked(0.0, 0.0).found == ()


def ball(rng: np.random.Generator, name: str, *, wrong: bool) -> Trajectory:
    """A ball with lift and a spin measured once, with its sign read wrongly where asked for; explicit steps of a tenth of a row."""
    times = np.arange(BALL.rows) / RATE_HZ
    x, v, omega = np.zeros(3), np.array([7.0, 0.0, 1.0]) + rng.normal(0.0, 0.5, 3), np.array([0.0, 1.0, 0.0]) * rng.uniform(-200.0, 200.0)
    omega = omega + rng.normal(0.0, 60.0, 3)
    seen, step = [x], 0.1 / RATE_HZ
    for _ in times[1:]:
        for _ in range(10):
            half = v + 0.5 * step * (GRAVITY + LIFT * np.cross(omega, v))
            x, v = x + step * half, v + step * (GRAVITY + LIFT * np.cross(omega, half))
        seen.append(x)
    made = measured(name, rng, Hidden(), BALL)
    read = np.full((BALL.rows, 3), np.nan)
    read[BALL.rows // 2] = (-omega if wrong else omega) + rng.normal(0.0, 2.0, 3)
    x_world = np.array(seen) + rng.normal(0.0, BALL.sigma_x, (BALL.rows, 3))
    return replace(made, x_world=x_world, omega_world=read, sigma_omega=read * 0.0 + 2.0)


@pytest.mark.parametrize("wrong", [(), WRONG], ids=["right", "two wrong"])
def test_lift_is_measured_beside_spins_that_were_read_wrongly(wrong: tuple[int, ...]) -> None:
    rng = np.random.default_rng(4)
    trajectories = [ball(rng, f"shot_{i}", wrong=i in wrong) for i in range(NUMBER)]
    registered = register_trajectories(trajectories)
    tried = ("magnus_lift", "unmeasured_lift", "uniform_acceleration", "quadratic_drag")
    found = explain(registered.campaign, registered.start, {key: catalogue()[key] for key in tried})
    assert found.found == ("magnus_lift",)  # what a reading is wrong by is noise, in the model and in no answer
    assert abs(value_of(found, "magnus_lift") - LIFT) < 0.1 * LIFT
    assert found.held_out.rms_px < 1.5  # a spin that was read once is never left out
    assert {number for number, task in enumerate(found.campaign.sequences) if task.misread} == set(wrong)
