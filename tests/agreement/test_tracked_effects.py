"""Effects that only trajectories show: nature's motion and readings, by SciPy's DOP853, are what the instrument predicts and recovers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from datasets.vocabulary.effects import EFFECTS, TRACKED_ONLY
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import register_trajectories
from synth.effects.in_force import EffectsInForce
from synth.effects.links import FlightState
from tests.agreement.trajectory_derivatives import held_to_central_differences

Array = np.ndarray
GRAVITY = np.array([0.0, 0.0, -9.81])
TIMES = np.arange(30) / 100.0
SCATTERED = TIMES + 2e-5 * np.concatenate([np.tile([1.0, -1.0, -1.0, 1.0], 7), np.zeros(2)])
"""Stamps beside which even times are those of ``TIMES``."""
SIZES = {
    "stamp_scatter": {"share": 0.9},
    "quadratic_drag": {"per_length": 0.15},
    "saturating_lift": {"coefficient": 5e-3, "length": 0.04},
    "induced_drag": {"ratio": 0.3},
    "magnus_lift": {"coefficient": 5e-3},
    "unmeasured_drag": {"rate": 0.3},
    "steady_wind": {"w_x": 0.6, "w_y": -0.5, "w_z": 0.3},
    "position_distortion": {"k": 0.01, "p_x": 0.004, "p_y": -0.006, "p_z": 0.003},
    "perspective": {"q_x": 0.01, "q_y": -0.02, "q_z": 0.015},
    "unmeasured_lift": {"w_x": 0.1, "w_y": -0.15, "w_z": 0.05},
    "gyroscope_bias": {"b_x": 0.05, "b_y": -0.03, "b_z": 0.02},
    "gyroscope_scale": {"s_x": 0.02, "s_y": -0.01, "s_z": 0.03},
}
CASES = {
    "stamp_scatter": ("stamp_scatter",),
    "saturating_lift": ("quadratic_drag", "saturating_lift"),
    "induced_drag": ("magnus_lift", "induced_drag"),
    "unmeasured_drag": ("unmeasured_drag",),
    "steady_wind": ("quadratic_drag", "steady_wind"),
    "position_distortion": ("position_distortion",),
    "perspective": ("perspective",),
    "unmeasured_lift": ("unmeasured_lift",),
    "gyroscope_bias": ("gyroscope_bias",),
    "gyroscope_scale": ("gyroscope_scale",),
}
OF_TUMBLING_BODIES = ("products_of_inertia", "nutation_damping")
"""In :mod:`tests.agreement.test_tumbling_bodies`; the flights here are those of balls."""
SIGMA_X, SIGMA_THETA, SIGMA_SPIN = 5e-5, 1e-3, 5e-3
MIDDLE, REACH_M = np.array([0.0, 0.0, -0.1]), 0.6
"""Of the volume that a tracker measures."""


def of_nature(keys: tuple[str, ...], rng: np.random.Generator, name: str) -> Trajectory:
    """A ball's flight with effects, without noise: poses and readings, or positions and spin where a force is hidden."""
    force = EffectsInForce({key: SIZES[key] for key in keys})
    stamps = SCATTERED if "stamp_scatter" in keys else TIMES
    times = force.true_times(stamps, rng)
    v, omega = rng.uniform(-6.0, 6.0, 3), rng.normal(0.0, 1.0, 3) * rng.uniform(2.0, 200.0)
    if not force.push:
        omega = rng.normal(0.0, 8.0, 3)

    def rate(_: float, y: Array) -> Array:
        # The attitude of a ball with a constant spin turns about it.
        state = FlightState(0.0, y[:3], y[3:], np.eye(3), omega, np.ones(3), 1.0)
        return np.concatenate([y[3:], GRAVITY + (force.acceleration(state) if force.push else 0.0)])

    solved = solve_ivp(rate, (0.0, 0.4), np.concatenate([np.zeros(3), v]), method="DOP853", t_eval=times, rtol=1e-11, atol=1e-12)
    x, n = force.tracked(solved.y[:3].T, MIDDLE, REACH_M), len(TIMES)
    where = Surroundings(GRAVITY, Body(np.zeros(3), np.eye(3), np.ones(3)))
    spins, sigma_x, sigma_spin = np.tile(omega, (n, 1)), np.full((n, 3), SIGMA_X), np.full((n, 3), SIGMA_SPIN)
    if force.push:
        return Trajectory(name, stamps, x, None, spins, sigma_x, None, sigma_spin, where)
    size = float(np.linalg.norm(omega))
    half = 0.5 * size * times[:, None]
    q = np.hstack([np.sin(half) * omega / size, np.cos(half)])
    sigma_theta = np.full((n, 3), SIGMA_THETA)
    return Trajectory(name, stamps, x, q, None, sigma_x, sigma_theta, None, where, force.gyroscope(spins), sigma_spin)


def in_the_true_volume(registered: Registered) -> Registered:
    """A campaign whose tracker is described about the true middle and reach, not about those of what was measured."""
    tasks = [replace(t, setting=replace(t.setting, middle_world=MIDDLE, reach_m=REACH_M)) for t in registered.campaign.sequences]
    return replace(registered, campaign=replace(registered.campaign, sequences=tuple(tasks)))


def test_every_such_effect_is_held_to_nature() -> None:
    assert set(CASES) | set(OF_TUMBLING_BODIES) == set(TRACKED_ONLY)


@pytest.mark.parametrize("key", CASES)
def test_what_nature_does_is_recovered(key: str) -> None:
    keys, rng = CASES[key], np.random.default_rng(5)
    trajectories = [of_nature(keys, rng, f"{key}_{number}") for number in range(4)]
    registered = in_the_true_volume(register_trajectories(trajectories))
    model = Model(tuple(MODELS[k] for k in keys))
    begin = np.concatenate([MODELS[k].starts(registered.campaign.sequences[0].setting)[0] for k in keys])
    begin[[name.endswith(("coefficient", "per_length")) for name in model.names]] = 5e-3
    start = CampaignState(registered.start.flights, tuple(begin for _ in trajectories))
    fit = fit_campaign(registered.campaign, start, model)
    true = np.concatenate([[SIZES[k][name] for name in EFFECTS[k].names] for k in keys])
    assert fit.settled
    np.testing.assert_allclose(fit.state.theta[0], true, rtol=2e-3)
    # Rows in a step are wrong by less than a micrometre.
    assert max(np.abs(each.errors.e).max() for each in fit.equations) < 0.05


@pytest.mark.parametrize("key", CASES)
def test_derivatives_are_central_differences(key: str) -> None:
    trajectory = of_nature(CASES[key], np.random.default_rng(2), key)
    held_to_central_differences(trajectory, {k: SIZES[k] for k in CASES[key]})
