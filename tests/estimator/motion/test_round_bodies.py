"""Round bodies are flown from row to row as they are with steps that follow every turn."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.vocabulary.body import Body
from estimator.effects.choosing import catalogue
from estimator.effects.link import EffectModel, Moment, Setting
from estimator.effects.model import Model, ModelForces
from estimator.motion.flight import INERTIA, OMEGA, Flight, V, inertia_matrix, states
from estimator.motion.rigid_body import RanAway, States, fall, propagate
from estimator.motion.round_bodies import round_fall

GRAVITY = np.array([0.0, 0.0, -9.81])
TIMES = np.arange(0.0, 0.26, 0.007)
FLIGHT = Flight(
    *(0.11, np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.5, -0.5, 0.5]), np.array([-5.0, 1.0, 2.0]), np.array([150.0, -20.0, 90.0])),
    *(Body(np.zeros(3), np.eye(3), np.ones(3)), np.zeros(3), np.zeros(5), 0.0, GRAVITY),
)
STEPS = np.zeros((3, 21))
STEPS[1, V], STEPS[2, OMEGA] = 0.1, 1.0
VALUES = {"quadratic_drag": [0.15], "magnus_lift": [3e-3], "spin_damping": [2.0], "gravity": [0.1, 0.2, -0.1], "linear_drag": [20.0]}


def started() -> States:
    return states(FLIGHT, STEPS, np.array([FLIGHT.time_s]))


def at_start() -> States:
    first = started()
    return States(first.x[0], first.q[0], first.v[0], first.L[0])


@pytest.mark.parametrize("keys", [("quadratic_drag", "magnus_lift"), ("magnus_lift", "spin_damping", "gravity"), ("linear_drag",)])
def test_forces_and_torques_act_as_in_steps_that_follow_every_turn(keys: tuple[str, ...]) -> None:
    model = Model(tuple(catalogue()[key] for key in keys))
    theta = np.tile(np.concatenate([VALUES[key] for key in keys]), (3, 1))
    forces = ModelForces(model, theta, Setting(TIMES, 0.0, GRAVITY, np.ones(3)))
    found = states(FLIGHT, STEPS, TIMES, forces)
    dense = np.arange(0.0, TIMES[-1] + 1e-9, 1e-4)
    known = propagate(
        at_start(),
        np.tile(np.eye(3), (3, 1, 1)),
        dense,
        start_time_s=FLIGHT.time_s,
        acceleration=lambda t, s, w: GRAVITY + forces.acceleration(t, s, w),
        torque=forces.torque,
    )
    x, q, v, L = (each[::70] for each in (known.x, known.q, known.v, known.L))
    # Known steps turn by 0.018 rad: 2e-11 rad off each. Steps of 0.12 of a decay are wrong by 0.12^5 / 120 = 2e-7 of it, rows in them by
    # 0.12^4 / 384 = 5e-7, over at most 50 steps.
    np.testing.assert_allclose(found.x, x, atol=2e-6)
    np.testing.assert_allclose(found.v, v, atol=2e-5)
    np.testing.assert_allclose(found.L, L, atol=2e-3)
    np.testing.assert_allclose(found.q, q * np.sign(np.sum(found.q * q, axis=2, keepdims=True)), atol=1e-5)


def test_a_fall_is_the_same_in_closed_form() -> None:
    known = fall(at_start(), np.tile(np.eye(3), (3, 1, 1)), TIMES, start_time_s=FLIGHT.time_s, gravity=GRAVITY)
    found = states(FLIGHT, STEPS, TIMES)
    np.testing.assert_allclose(found.x, known.x, rtol=1e-12)
    np.testing.assert_allclose(found.L, known.L)
    # Steps of 0.12 rad miss by 4e-7 rad each, over 26 rad.
    np.testing.assert_allclose(found.q, known.q * np.sign(np.sum(found.q * known.q, axis=2, keepdims=True)), atol=2e-4)


def test_a_spin_beyond_every_camera_ran_away() -> None:
    first = at_start()
    with pytest.raises(RanAway):
        round_fall(States(first.x, first.q, first.v, 1e6 * first.L), TIMES, start_time_s=0.0, gravity=GRAVITY)


@pytest.mark.parametrize("ratios", [(1.0, 1.0, 1.0), (0.6, 0.8, 1.0)])
def test_forces_that_never_change_act_as_gravity_does(ratios: tuple[float, float, float]) -> None:
    model = Model((catalogue()["gravity"], catalogue()["uniform_acceleration"]))
    theta = np.array([[0.1, 0.2, -0.1, 1.0, 0.0, 0.5], [0.1, 0.2, -0.1, 1.0, 0.1, 0.5], [0.3, 0.2, -0.1, 1.0, 0.0, 0.5]])
    forces = ModelForces(model, theta, Setting(TIMES, 0.0, GRAVITY, np.ones(3)))
    flight = replace(FLIGHT, body=Body(np.zeros(3), np.eye(3), np.array(ratios)))
    assert forces.constant
    found, first = (states(flight, STEPS, times, forces) for times in (TIMES, np.array([flight.time_s])))
    known = propagate(
        States(first.x[0], first.q[0], first.v[0], first.L[0]),
        np.linalg.inv(inertia_matrix(flight, STEPS[:, INERTIA])),
        TIMES,
        start_time_s=flight.time_s,
        acceleration=lambda t, s, w: GRAVITY + forces.acceleration(t, s, w),
    )
    np.testing.assert_allclose(found.x, known.x, rtol=1e-12)
    np.testing.assert_allclose(found.v, known.v, rtol=1e-12)
    np.testing.assert_allclose(found.q, known.q * np.sign(np.sum(found.q * known.q, axis=2, keepdims=True)), atol=2e-4)
    np.testing.assert_array_equal(found.q, states(flight, STEPS, TIMES).q)  # forces alone turn no body


@pytest.mark.parametrize("effect", [effect for effect in catalogue().values() if effect.constant])
def test_effects_that_say_so_push_alike_at_every_moment(effect: EffectModel) -> None:
    rng, setting = np.random.default_rng(0), Setting(TIMES, 0.0, GRAVITY, np.ones(3))
    theta = rng.normal(size=(2, len(effect.entry.parameters)))
    moments = (Moment(float(t), *rng.normal(size=(4, 2, 3)), rng.normal(size=(2, 3, 3)), rng.normal(size=(2, 3))) for t in (0.1, 0.2))
    first, second = (effect.acceleration(theta, moment, setting) for moment in moments)
    np.testing.assert_array_equal(first, second)
    assert not effect.touches("torque")
