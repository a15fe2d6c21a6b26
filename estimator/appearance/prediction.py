"""Poses under a model with effects, and their derivatives by the flight's and the effects' parameters.

All perturbed flights are integrated side by side. Only forces need that: a clock effect moves a pose along its velocity, a body effect is a
combination of the flight's own columns, and a scale divides what the camera sees.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.data.seen_by import SeenBy
from estimator.effects.dependence import of_body
from estimator.effects.link import EffectModel, Setting
from estimator.effects.model import Model, ModelForces
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, STEPS, Flight, FlightPoses, inertia_matrix, pose_differences, states
from estimator.motion.rigid_body import States, angular_velocity, cross_product, inverted, rotation_matrices

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prediction:
    """Where the nominal body is at the times of n sightings.

    ``poses`` (n, 1, ·) of the nominal centre of mass and body axes; ``velocity`` (n, 3) m/s of that centre and ``omega`` (n, 3) rad/s,
    world frame; ``sensitivity`` (n, 6, 21 + q): translation (m) and left rotation vector (rad), by the flight's and the model's parameters;
    ``spin_sensitivity`` (n, 3, 21 + q): that of ``omega`` (rad/s), where it was asked for.
    """

    poses: FlightPoses
    velocity: Array
    omega: Array
    sensitivity: Array
    spin_sensitivity: Array | None = None


VARIED = STEPS > 0.0
"""The flight's parameters (21,) that poses depend on."""


def predict(
    flight: Flight,
    model: Model,
    theta: Array,
    setting: Setting,
    times_s: Array,
    *,
    rows_px: Array | None = None,
    seen: SeenBy | None = None,
    varied: NDArray[np.bool_] = VARIED,
    spins: bool = False,
) -> Prediction:
    """Poses at nominal times ``times_s`` (n,) and their derivatives.

    ``theta`` (q,) of the model; of outlines, if there are any, ``rows_px`` (n,) and by which cameras they are ``seen``.
    ``varied`` (21,): the flight's parameters by which derivatives are wanted, others are zero; ``spins``: those of the spin, too.
    """
    rows_px = np.zeros(len(times_s)) if rows_px is None else rows_px
    change = model.body(theta, setting)
    flight = replace(flight, com=flight.com + change.com, inertia=flight.inertia + change.inertia)
    true_times = model.times(theta, setting, times_s, seen) + model.delays(theta, rows_px, seen)
    forced = _forced(model)
    varied = varied if (varied == VARIED).all() else varied | _of_body(model)
    steps, thetas, widths = _perturbations(model, theta, np.concatenate([varied, forced]))
    forces = ModelForces(model, thetas, setting) if forced.any() else None
    reached = states(flight, steps, true_times, forces)
    R = rotation_matrices(reached.q)
    centre = reached.x - np.einsum("fmij,mj->fmi", R, flight.com + steps[:, COM])
    S = np.zeros((len(times_s), 6, N_PARAMETERS + model.size))
    columns = np.concatenate([np.flatnonzero(varied), N_PARAMETERS + np.flatnonzero(forced)])
    S[:, :, columns] = pose_differences(FlightPoses(centre, R), widths)
    velocity, omega = _velocities(flight, reached, R[:, 0])
    changing, moving = S, np.hstack([velocity, omega])
    if spins:
        changing = np.concatenate([S, np.zeros((len(times_s), 3, S.shape[2]))], axis=1)
        changing[:, 6:, columns] = _spin_differences(flight, steps, reached, widths)
        moving = np.hstack([moving, np.gradient(omega, true_times, axis=0)])
    for effect, part in model.touching("times", "delays", "body"):
        changing[:, :, N_PARAMETERS + part.start : N_PARAMETERS + part.stop] += _unforced(
            effect, theta[part], setting, (times_s, rows_px, seen), (changing, moving)
        )
    poses = FlightPoses(centre[:, :1], R[:, :1])
    return Prediction(poses, velocity, omega, changing[:, :6], changing[:, 6:] if spins else None)


def _of_body(model: Model) -> NDArray[np.bool_]:
    """The flight's parameters (21,) through which effects on the body act."""
    mask = np.zeros(N_PARAMETERS, dtype=np.bool_)
    changed = frozenset[str]().union(*(of_body(effect) for effect, _ in model.touching("body")))
    mask[COM], mask[INERTIA] = "com" in changed, "inertia" in changed
    return mask


def _spin_differences(flight: Flight, steps: Array, reached: States, widths: Array) -> Array:
    """Central differences (n, 3, w) of the angular velocities of pairs of flights."""
    inverse = inverted(inertia_matrix(flight, flight.inertia + steps[:, INERTIA]))
    omega = np.stack([angular_velocity(q, L, inverse) for q, L in zip(reached.q, reached.L, strict=True)])
    return np.asarray(np.swapaxes((omega[:, 1::2] - omega[:, 2::2]) / widths[:, None], 1, 2))


def _forced(model: Model) -> NDArray[np.bool_]:
    """Which parameters (q,) enter the equations of motion as forces."""
    mask = np.zeros(model.size, dtype=np.bool_)
    for _, part in model.touching("air", "acceleration", "torque"):
        mask[part] = True
    return mask


def _perturbations(model: Model, theta: Array, varied: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Steps (m, 21) and thetas (m, q) of the unperturbed flight and of each pair in ``varied`` (21 + q,), and the pairs' widths."""
    own, extra = np.flatnonzero(varied[:N_PARAMETERS]), np.flatnonzero(varied[N_PARAMETERS:])
    size = np.concatenate([STEPS[own], model.steps[extra]])
    m = 1 + 2 * len(size)
    steps, thetas = np.zeros((m, N_PARAMETERS)), np.tile(theta, (m, 1))
    for row, step in enumerate(size):
        into, column = (steps, own[row]) if row < len(own) else (thetas, extra[row - len(own)])
        into[1 + 2 * row, column] += step
        into[2 + 2 * row, column] -= step
    return steps, thetas, 2.0 * size


def _velocities(flight: Flight, reached: States, R: Array) -> tuple[Array, Array]:
    """Velocity of the nominal centre and angular velocity (n, 3) of the unperturbed flight."""
    inverse = inverted(inertia_matrix(flight, flight.inertia[None]))
    omega = angular_velocity(reached.q[:, 0], reached.L[:, 0], np.broadcast_to(inverse, (len(R), 3, 3)))
    return np.asarray(reached.v[:, 0] - cross_product(omega, R @ flight.com)), omega


def _unforced(
    effect: EffectModel, theta: Array, setting: Setting, when: tuple[Array, Array, SeenBy | None], at: tuple[Array, Array]
) -> Array:
    """Columns (n, c, q) of one effect through clock and body, from the flight's (n, c, 21 + q) and the rates (n, c) of what they are of."""
    (times_s, rows_px, seen), (S, rates), alone = when, at, Model((effect,))
    result = np.zeros((*S.shape[:2], len(theta)))
    if alone.touching("times", "delays"):
        for column, step in enumerate(alone.steps):
            up, down = theta.copy(), theta.copy()
            up[column], down[column] = up[column] + step, down[column] - step
            later = alone.times(up, setting, times_s, seen) - alone.times(down, setting, times_s, seen)
            later = later + (alone.delays(up, rows_px, seen) - alone.delays(down, rows_px, seen))
            result[:, :, column] = rates * (later / (2.0 * step))[:, None]
    if alone.touching("body"):
        result += S[:, :, np.r_[COM, INERTIA]] @ effect.body_by(theta, setting)
    return result
