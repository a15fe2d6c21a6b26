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
FORCES = ("acceleration", "torque")
"""The links by which an effect pushes and turns a body."""


def body_under(flight: Flight, model: Model, theta: Array, setting: Setting) -> Flight:
    """The flight with what the model's effects do to its body at ``theta`` (q,)."""
    change = model.body(theta, setting)
    return replace(flight, com=flight.com + change.com, inertia=flight.inertia + change.inertia)


def forced_states(
    flight: Flight, steps: Array, at: tuple[Model, Array, Setting], times_s: Array, *, forces_at: Array | None = None
) -> tuple[States, Array]:
    """States (f, m, ·) and angular velocities (f, m, 3) at nominal ``times_s`` of the flights reached by steps (m, 21).

    ``at``: model, its parameters (q,), setting. ``forces_at`` (m, q): parameters for the forces on each flight; ``None``: those of ``at``.
    """
    model, theta, setting = at
    own = body_under(flight, model, theta, setting)
    forced = any(overrides(e, *FORCES) for e in model.effects)
    forces = ModelForces(model, np.tile(theta, (len(steps), 1)) if forces_at is None else forces_at, setting) if forced else None
    reached = states(own, steps, model.times(theta, setting, times_s), forces)
    inverse = inverted(inertia_matrix(own, own.inertia + steps[:, INERTIA]))
    omega = np.stack([angular_velocity(q, L, inverse) for q, L in zip(reached.q, reached.L, strict=True)])
    return reached, omega


def motion_under(flight: Flight, model: Model, theta: Array, setting: Setting) -> Motion:
    """Poses of the fitted body and velocities at the nominal times of all frames; ``theta`` (q,) of the model."""
    times = setting.times_s
    reached, omega = forced_states(flight, np.zeros((1, N_PARAMETERS)), (model, theta, setting), times)
    own = body_under(flight, model, theta, setting)
    turn = own.body.R_particle_body.T @ fitted_body(own).R_particle_body
    R = rotation_matrices(reached.q[:, 0]) @ turn
    return Motion(times, reached.x[:, 0], quaternion(R), reached.v[:, 0], omega[:, 0])


def velocities_under(
    flight: Flight, model: Model, theta: Array, setting: Setting, time_s: float, *, known: NDArray[np.bool_] | None = None
) -> tuple[Array, Array]:
    """(v, omega) (6,) at a nominal time, and its derivative (6, 21 + q); zero by parameters of the flight that are ``known`` (21,).

    ``theta`` (q,) of the model.
    """
    times, at = np.array([time_s]), (model, theta, setting)
    varied = np.flatnonzero(STEPS) if known is None else np.flatnonzero((STEPS > 0.0) & ~known)
    pushed, carried = _columns(model)
    size = np.concatenate([STEPS[varied], model.steps[pushed]])
    moved = np.diag(np.concatenate([STEPS, model.steps]))[np.concatenate([varied, N_PARAMETERS + pushed])]
    moved = np.vstack([np.zeros(N_PARAMETERS + model.size), moved, -moved])
    steps, thetas = moved[:, :N_PARAMETERS], theta + moved[:, N_PARAMETERS:]
    reached, omega = forced_states(flight, steps, at, times, forces_at=thetas)
    every = np.hstack([reached.v[0], omega[0]])
    high, low = np.split(every[1:], 2)
    J = np.zeros((6, N_PARAMETERS + model.size))
    J[:, np.concatenate([varied, N_PARAMETERS + pushed])] = ((high - low) / (2.0 * size)[:, None]).T
    for column in carried:
        J[:, N_PARAMETERS + column] = _derivative(flight, at, times, int(column))
    return every[0], J


def _columns(model: Model) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Parameters of effects that only push, and of those that change the body or the clock; no other changes how a body moves."""
    columns = [(e, np.arange(part.start, part.stop)) for e, part in zip(model.effects, model.slices, strict=True)]
    carried = [each for e, each in columns if overrides(e, "body", "times")]
    pushed = [each for e, each in columns if overrides(e, "air", *FORCES) and not overrides(e, "body", "times")]
    none = np.zeros(0, dtype=np.int64)
    return np.concatenate([none, *pushed]), np.concatenate([none, *carried])


def _derivative(flight: Flight, at: tuple[Model, Array, Setting], times_s: Array, column: int) -> Array:
    """Derivative (6,) of (v, omega) by one of the model's parameters."""
    model, theta, setting = at
    change = np.zeros(model.size)
    change[column] = model.steps[column]
    high, low = (_velocity(flight, (model, theta + sign * change, setting), times_s) for sign in (1.0, -1.0))
    return np.asarray((high - low) / (2.0 * model.steps[column]))


def _velocity(flight: Flight, at: tuple[Model, Array, Setting], times_s: Array) -> Array:
    reached, omega = forced_states(flight, np.zeros((1, N_PARAMETERS)), at, times_s)
    return np.concatenate([reached.v[0, 0], omega[0, 0]])
