"""Velocities under a model: without effects those of the free flight, with effects what their equations say; derivatives are right."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.fitting.campaigns.forced_velocities import motion_under, reached_under, velocities_under
from estimator.motion.flight import N_PARAMETERS, moved, velocities, velocity_sensitivity
from estimator.motion.reached import Reached
from estimator.motion.rotation import rotation_vector
from estimator.reports.reporting import motion_of
from tests.estimator.small_campaign import registered

SETTING = registered().campaign.sequences[0].setting
FLIGHT = registered().start.flights[0]
TIME_S = float(SETTING.times_s[20])


def test_without_effects_it_is_the_free_flight() -> None:
    value, J = velocities_under(FLIGHT, Model(()), np.zeros(0), SETTING, TIME_S)
    v, omega = velocities(FLIGHT, np.zeros((1, N_PARAMETERS)), TIME_S)
    assert np.allclose(value, np.concatenate([v[0], omega[0]]), rtol=1e-12)
    assert np.allclose(J, velocity_sensitivity(FLIGHT, TIME_S), rtol=1e-6, atol=1e-7)
    free, motion = motion_of(FLIGHT, SETTING.times_s), motion_under(FLIGHT, Model(()), np.zeros(0), SETTING)
    assert np.allclose(motion.x_world, free.x_world, atol=1e-12)
    assert np.allclose(motion.omega_world, free.omega_world, rtol=1e-9)
    assert np.allclose(np.abs(np.sum(motion.q_world_body * free.q_world_body, axis=1)), 1.0)


def test_a_known_acceleration() -> None:
    model, theta = Model((catalogue()["uniform_acceleration"],)), np.array([1.0, -2.0, 0.5])
    free, _ = velocities_under(FLIGHT, Model(()), np.zeros(0), SETTING, TIME_S)
    pushed, J = velocities_under(FLIGHT, model, theta, SETTING, TIME_S)
    assert np.allclose(pushed[:3] - free[:3], theta * (TIME_S - FLIGHT.time_s), rtol=1e-6)
    assert np.allclose(pushed[3:], free[3:])
    assert np.allclose(J[:3, N_PARAMETERS:], np.eye(3) * (TIME_S - FLIGHT.time_s), rtol=1e-4)


def test_a_clock_that_runs_wrong_moves_the_time() -> None:
    model, theta = Model((catalogue()["frame_rate"],)), np.array([0.02])
    later, _ = velocities_under(FLIGHT, model, theta, SETTING, TIME_S)
    first = float(SETTING.times_s[0])
    at = first + (TIME_S - first) / 1.02
    assert np.allclose(later, velocities_under(FLIGHT, Model(()), np.zeros(0), SETTING, at)[0], rtol=1e-9)


@pytest.mark.parametrize("key", ["quadratic_drag", "magnus_lift", "spin_damping", "inertia_ratios", "frame_rate"])
def test_derivatives_by_all_parameters(key: str) -> None:
    effect = catalogue()[key]
    model = Model((effect,))
    theta = 0.1 * np.array([p.plausible[1] for p in effect.entry.parameters])
    there = reached_under(FLIGHT, model, theta, SETTING, TIME_S)
    rng = np.random.default_rng(0)
    step = np.concatenate([rng.normal(size=N_PARAMETERS) * 1e-4, rng.normal(size=model.size) * 1e-3 * theta])
    step[20] = 0.0

    def at(sign: float) -> Reached:
        flight = moved(replace(FLIGHT), sign * step[:N_PARAMETERS])
        return reached_under(flight, model, theta + sign * step[N_PARAMETERS:], SETTING, TIME_S)

    high, low = at(1.0), at(-1.0)
    slope = 0.5 * (high.velocity - low.velocity)
    assert np.allclose(there.velocity_J @ step, slope, rtol=1e-3, atol=1e-4 * np.abs(slope).max())
    turn = rotation_vector((high.R @ low.R.T)[None])[0]
    assert np.allclose(there.pose_J @ step, 0.5 * np.concatenate([high.x - low.x, turn]), rtol=1e-3, atol=1e-7)
