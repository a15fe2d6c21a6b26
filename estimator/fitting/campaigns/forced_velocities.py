"""Poses and velocities of a flight under a model with effects, and their derivatives by all parameters.

``v`` is that of the centre of mass, ``omega`` the angular velocity, world frame, at a nominal time: the clock's effects say when that truly
was, those of the body what turns. Derivatives are central differences over the whole flight.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.state import Motion
from estimator.effects.link import Setting
from estimator.effects.model import Model, ModelForces, overrides
from estimator.motion.flight import (
    INERTIA,
    LAYOUT,
    STEPS,
    Flight,
    FlightPoses,
    fitted_body,
    inertia_matrix,
    pose_differences,
    states,
    still,
)
from estimator.motion.reached import Reached
from estimator.motion.rigid_body import States, angular_velocity, inverted, rotation_matrices
from estimator.motion.rotation import quaternion

Array = NDArray[np.float64]
_At = tuple[Model, Array, Setting]
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
    reached, omega = forced_states(flight, still(flight), (model, theta, setting), times)
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
    there = reached_under(flight, model, theta, setting, time_s, known=known)
    return there.velocity, there.velocity_J


def reached_under(
    flight: Flight, model: Model, theta: Array, setting: Setting, time_s: float, *, known: NDArray[np.bool_] | None = None
) -> Reached:
    """The motion at a nominal time; derivatives are zero by parameters of the flight that are ``known`` (21,).

    ``theta`` (q,) of the model.
    """
    times, at = np.array([time_s]), (model, theta, setting)
    layout, first = model.layout, LAYOUT.size
    pushed, carried = _columns(model)
    columns = np.concatenate([np.flatnonzero(STEPS if known is None else STEPS * ~known), first + pushed])
    moved = np.diag(layout.steps)[columns]
    moved = np.vstack([np.zeros(layout.size), moved, -moved])
    x, R, velocity = _motions(flight, at, (moved[:, :first], theta + moved[:, first:]), times)
    J = np.zeros((12, layout.size))
    J[:, columns] = _differences(x, R, velocity, 2.0 * layout.steps[columns])
    for column in carried:
        J[:, first + column] = _derivative(flight, at, times, int(column))
    return Reached(x[0], R[0], velocity[0], J[:6], J[6:])


def _motions(flight: Flight, at: _At, by: tuple[Array, Array | None], times_s: Array) -> tuple[Array, Array, Array]:
    """Positions (m, 3), rotations (m, 3, 3) and (v, omega) (m, 6) at one time of flights reached by steps and parameters of forces."""
    reached, omega = forced_states(flight, by[0], at, times_s, forces_at=by[1])
    return reached.x[0], rotation_matrices(reached.q[0]), np.hstack([reached.v[0], omega[0]])


def _differences(x: Array, R: Array, velocity: Array, widths: Array) -> Array:
    """Central differences (12, w) of pose and (v, omega) between a flight, w others and their opposites, ``widths`` (w,) apart."""
    order = np.concatenate([[0], np.arange(1, len(x)).reshape(2, -1).T.ravel()])
    high, low = np.split(velocity[1:], 2)
    pose = pose_differences(FlightPoses(x[None, order], R[None, order]), widths)[0]
    return np.vstack([pose, ((high - low) / widths[:, None]).T])


def _columns(model: Model) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Parameters of effects that only push, and of those that change the body or the clock; no other changes how a body moves."""
    columns = [(e, np.arange(part.start, part.stop)) for e, part in zip(model.effects, model.slices, strict=True)]
    carried = [each for e, each in columns if overrides(e, "body", "times")]
    pushed = [each for e, each in columns if overrides(e, "air", *FORCES) and not overrides(e, "body", "times")]
    none = np.zeros(0, dtype=np.int64)
    return np.concatenate([none, *pushed]), np.concatenate([none, *carried])


def _derivative(flight: Flight, at: _At, times_s: Array, column: int) -> Array:
    """Derivative (12,) of pose and (v, omega) by one of the model's parameters."""
    model, theta, setting = at
    change = np.zeros(model.size)
    change[column] = model.steps[column]
    each = [_motions(flight, (model, theta + sign * change, setting), (still(flight), None), times_s) for sign in (0.0, 1.0, -1.0)]
    x, R, velocity = (np.concatenate(parts) for parts in zip(*each, strict=True))
    return _differences(x, R, velocity, 2.0 * model.steps[[column]])[:, 0]
