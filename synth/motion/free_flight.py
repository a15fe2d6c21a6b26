"""Flight of a rigid body under gravity alone.

The centre of mass falls: ``x = x0 + v0 t + g t²/2``. The rotation is torque-free: with the principal moments ``I`` and the
angular velocity ``w`` in the body frame, ``I w' = (I w) x w`` and ``q' = q (w, 0) / 2`` [Goldstein, Classical Mechanics, 3rd ed.,
eq. 5.39; quaternions scalar-last]. Both are integrated by DOP853 close to rounding level with dense output, so that the motion is
known at any instant; energy and angular momentum keep to 1e-12 over a hundred frames. Only ratios of the moments matter. No air:
the effects that change this act elsewhere.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from datasets.vocabulary.state import Motion
from synth.motion.dense_solution import DenseSolution

Array = NDArray[np.float64]

RTOL = 3e-14
ATOL = 1e-14


@dataclass(frozen=True)
class Start:
    """The state at time zero: ``x_world`` m, ``q_world_body`` (x, y, z, w), ``v_world`` m/s, ``omega_world`` rad/s, all (3,) or (4,)."""

    x_world: Array
    q_world_body: Array
    v_world: Array
    omega_world: Array


@dataclass(frozen=True)
class FreeFlight:
    """A free flight, known over the span of its ``rotation``; made by :func:`fly`."""

    start: Start
    gravity_world: Array
    rotation: DenseSolution

    def at(self, times_s: Float[NDArray[np.float64], " n"]) -> Motion:
        """The motion at ``times_s`` (s).

        Raises
        ------
        ValueError
            Where a time lies outside the span that was integrated.
        """
        t = np.asarray(times_s, dtype=np.float64)
        rotation_state = self.rotation(t)
        q = rotation_state[:, 3:] / np.linalg.norm(rotation_state[:, 3:], axis=1, keepdims=True)
        s, g = self.start, self.gravity_world
        return Motion(
            times_s=t,
            x_world=s.x_world + s.v_world * t[:, None] + 0.5 * g * t[:, None] ** 2,
            q_world_body=q,
            v_world=s.v_world + g * t[:, None],
            omega_world=Rotation.from_quat(q).apply(rotation_state[:, :3]),
        )


def fly(
    start: Start,
    moments: Float[NDArray[np.float64], "3"],
    gravity_world: Float[NDArray[np.float64], "3"],
    *,
    earliest_s: float,
    latest_s: float,
) -> FreeFlight:
    """Integrate the flight that passes through ``start`` at time zero.

    Parameters
    ----------
    start
        State at time zero, world frame.
    moments
        Principal moments of inertia in the order of the body's axes; any common factor (kg m², or ratios).
    gravity_world
        Acceleration (m/s²).
    earliest_s, latest_s
        Span of times (s) over which the motion is wanted; zero lies within.
    """
    ratios = np.asarray(moments, dtype=np.float64) / np.max(moments)
    omega_body = Rotation.from_quat(start.q_world_body).inv().apply(start.omega_world)
    y0 = np.concatenate([omega_body, start.q_world_body])
    forward, backward = (_rotation(y0, ratios, end) for end in (max(latest_s, 1e-9), min(earliest_s, -1e-9)))
    rotation = DenseSolution(earliest_s, latest_s, forward, backward)
    return FreeFlight(start, np.asarray(gravity_world, dtype=np.float64), rotation)


def _rotation(y0: Array, ratios: Array, end_s: float) -> Any:
    i1, i2, i3 = (float(value) for value in ratios)

    def rate(_t: float, y: Array) -> list[float]:
        w1, w2, w3, qx, qy, qz, qw = y.tolist()
        return [
            (i2 - i3) / i1 * w2 * w3,
            (i3 - i1) / i2 * w3 * w1,
            (i1 - i2) / i3 * w1 * w2,
            0.5 * (qw * w1 + qy * w3 - qz * w2),
            0.5 * (qw * w2 + qz * w1 - qx * w3),
            0.5 * (qw * w3 + qx * w2 - qy * w1),
            -0.5 * (qx * w1 + qy * w2 + qz * w3),
        ]

    solution = solve_ivp(rate, (0.0, end_s), y0, method="DOP853", rtol=RTOL, atol=ATOL, dense_output=True)
    if not solution.success:
        raise ArithmeticError(f"the rotation could not be integrated to {end_s:g} s: {solution.message}")
    return solution.sol
