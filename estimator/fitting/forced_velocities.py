"""Velocities of a flight under a model with effects, and their derivatives by all parameters.

``v`` is that of the centre of mass, ``omega`` the angular velocity, world frame, at a nominal time: the clock's effects say when that truly
was, those of the body what turns. Derivatives are central differences over the whole flight.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.state import Motion
from estimator.effects.link import Setting
from estimator.effects.model import Model, ModelForces, overrides
from estimator.motion.flight import INERTIA, N_PARAMETERS, STEPS, Flight, fitted_body, inertia_matrix, states
from estimator.motion.rigid_body import States, angular_velocity, inverted, rotation_matrices
from estimator.motion.rotation import quaternion

Array = NDArray[np.float64]


def body_under(flight: Flight, model: Model, theta: Array, setting: Setting) -> Flight:
    """The flight with what the model's effects do to its body."""
    change = model.body(theta, setting)
    return replace(flight, com=flight.com + change.com, inertia=flight.inertia + change.inertia)


def forced_states(flight: Flight, steps: Array, at: tuple[Model, Array, Setting], times_s: Array) -> tuple[States, Array]:
    """States (f, m, ·) and angular velocities (f, m, 3) at nominal ``times_s`` of the flights reached by steps (m, 21)."""
    model, theta, setting = at
    own = body_under(flight, model, theta, setting)
    forced = any(overrides(e, "acceleration", "torque") for e in model.effects)
    forces = ModelForces(model, np.tile(theta, (len(steps), 1)), setting) if forced else None
    reached = states(own, steps, model.times(theta, setting, times_s), forces)
    inverse = inverted(inertia_matrix(own, own.inertia + steps[:, INERTIA]))
    omega = np.stack([angular_velocity(q, L, inverse) for q, L in zip(reached.q, reached.L, strict=True)])
    return reached, omega


def motion_under(flight: Flight, model: Model, theta: Array, setting: Setting) -> Motion:
    """Poses of the fitted body and velocities at the nominal times of all frames."""
    times = setting.times_s
    reached, omega = forced_states(flight, np.zeros((1, N_PARAMETERS)), (model, theta, setting), times)
    own = body_under(flight, model, theta, setting)
    turn = own.body.R_particle_body.T @ fitted_body(own).R_particle_body
    R = rotation_matrices(reached.q[:, 0]) @ turn
    return Motion(times, reached.x[:, 0], quaternion(R), reached.v[:, 0], omega[:, 0])


def velocities_under(
    flight: Flight, model: Model, theta: Array, setting: Setting, time_s: float, *, known: NDArray[np.bool_] | None = None
) -> tuple[Array, Array]:
    """(v, omega) (6,) at a nominal time, and its derivative (6, 21 + q); zero by parameters of the flight that are ``known`` (21,)."""
    times = np.array([time_s])
    varied = np.flatnonzero(STEPS) if known is None else np.flatnonzero((STEPS > 0.0) & ~known)
    steps = np.zeros((1 + 2 * len(varied), N_PARAMETERS))
    steps[1 + 2 * np.arange(len(varied)), varied] = STEPS[varied]
    steps[2 + 2 * np.arange(len(varied)), varied] = -STEPS[varied]
    reached, omega = forced_states(flight, steps, (model, theta, setting), times)
    every = np.hstack([reached.v[0], omega[0]])
    J = np.zeros((6, N_PARAMETERS + model.size))
    J[:, varied] = ((every[1::2] - every[2::2]) / (2.0 * STEPS[varied])[:, None]).T
    for column, step in enumerate(model.steps):
        change = np.zeros(model.size)
        change[column] = step
        high, low = (_velocity(flight, (model, theta + sign * change, setting), times) for sign in (1.0, -1.0))
        J[:, N_PARAMETERS + column] = (high - low) / (2.0 * step)
    return every[0], J


def _velocity(flight: Flight, at: tuple[Model, Array, Setting], times_s: Array) -> Array:
    reached, omega = forced_states(flight, np.zeros((1, N_PARAMETERS)), at, times_s)
    return np.concatenate([reached.v[0, 0], omega[0, 0]])
