"""How the poses of a free flight change with its state at time zero and its mass properties, by central differences of the exact motion.

The state is (position, turn, velocity, angular velocity) of the centre of mass in the world frame, three numbers each; a turn is a small
rotation vector (rad) applied after the orientation, and turning leaves the angular velocity's vector in the world as it is. Position and
velocity act on positions alone: ``dx = dx0 + dv t``. The rotation depends on the other six numbers.

Mass properties are where the body's material has its centre of mass (m, along the body's axes; where the flight is that of another point of
the body, its surface is shifted) and the inertia tensor's entries 11, 22, 33, 23, 13, 12, relative: ``dI_ij = e sqrt(I_i I_j)``.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synth.motion.free_flight import Start, fly

Array = NDArray[np.float64]

N_STATE, N_MASS = 12, 9
POSITION, TURN, VELOCITY, SPIN = (slice(3 * k, 3 * k + 3) for k in range(4))
COM, INERTIA = slice(0, 3), slice(3, 9)
ENTRIES = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
STEP_RAD = 1e-5
"""How far a step turns the body, at once or over half the flight. Central differences are off by its square, and by rounding over it."""


def pose_sensitivity(
    start: Start, moments: Float[NDArray[np.float64], "3"], times_s: Float[NDArray[np.float64], " n"], *, step_rad: float = STEP_RAD
) -> Float[NDArray[np.float64], "n 6 12"]:
    """Derivatives of positions (m) and turns (rad, world frame, of the orientation at each time) by the state at time zero.

    Parameters
    ----------
    start
        The state at time zero.
    moments
        Principal moments of inertia in the order of the body's axes (any common factor).
    times_s
        Times (s), rising, before and after zero.
    step_rad
        Size of a step (rad).
    """
    span = float(np.abs(times_s).max()) or 1.0
    derivatives = np.zeros((len(times_s), 6, N_STATE))
    derivatives[:, :3, POSITION] = np.eye(3)
    derivatives[:, :3, VELOCITY] = times_s[:, None, None] * np.eye(3)
    for k in range(3):
        turn, spin = step_rad * np.eye(3)[k], step_rad / span * np.eye(3)[k]
        turned = [_orientations(_turned(start, sign * turn), moments, times_s) for sign in (1, -1)]
        spun = [_orientations(replace(start, omega_world=start.omega_world + sign * spin), moments, times_s) for sign in (1, -1)]
        derivatives[:, 3:, TURN.start + k] = (turned[0] * turned[1].inv()).as_rotvec() / (2 * step_rad)
        derivatives[:, 3:, SPIN.start + k] = (spun[0] * spun[1].inv()).as_rotvec() / (2 * step_rad / span)
    return derivatives


def mass_sensitivity(
    start: Start, moments: Float[NDArray[np.float64], "3"], times_s: Float[NDArray[np.float64], " n"], *, step: float = STEP_RAD
) -> Float[NDArray[np.float64], "n 6 9"]:
    """Derivatives of the positions (m) at which a body is seen and of its turns (rad), world frame, by its mass properties.

    Parameters
    ----------
    start, moments, times_s
        As for :func:`pose_sensitivity`.
    step
        Relative size of a step of the inertia.
    """
    derivatives = np.zeros((len(times_s), 6, N_MASS))
    derivatives[:, :3, COM] = -_orientations(start, moments, times_s).as_matrix()
    size = np.sqrt(np.outer(moments, moments))
    for k, (i, j) in enumerate(ENTRIES):
        change = np.zeros((3, 3))
        change[i, j] = change[j, i] = step * size[i, j]
        less, more = (_orientations_of(start, np.diag(moments) + sign * change, times_s) for sign in (-1, 1))
        derivatives[:, 3:, INERTIA.start + k] = (more * less.inv()).as_rotvec() / (2 * step)
    return derivatives


def _orientations_of(start: Start, tensor: Array, times_s: Array) -> Rotation:
    """Orientations of a body of an inertia ``tensor`` (3, 3) that is not along its axes."""
    moments, axes = np.linalg.eigh(tensor)
    principal = Rotation.from_matrix(axes * np.linalg.det(axes))
    turned = replace(start, q_world_body=(Rotation.from_quat(start.q_world_body) * principal).as_quat())
    return _orientations(turned, moments, times_s) * principal.inv()


def _turned(start: Start, turn: Array) -> Start:
    return replace(start, q_world_body=(Rotation.from_rotvec(turn) * Rotation.from_quat(start.q_world_body)).as_quat())


def _orientations(start: Start, moments: Array, times_s: Array) -> Rotation:
    flight = fly(start, moments, np.zeros(3), earliest_s=min(times_s[0], 0.0), latest_s=max(times_s[-1], 0.0))
    return Rotation.from_quat(flight.at(times_s).q_world_body)
