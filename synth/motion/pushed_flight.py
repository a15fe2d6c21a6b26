"""Flight of a rigid body under gravity and other forces and torques.

``v' = g + a(state)``; in the body frame ``I w' = (I w) x w + torque`` and ``q' = q (w, 0) / 2`` [Goldstein, Classical Mechanics, 3rd ed.,
eq. 5.39; quaternions scalar-last], moments and torque over the largest moment. All thirteen numbers are integrated together by DOP853 close
to rounding level with dense output, so that the motion is known at any instant. Valid for forces that are smooth along the flight.
"""

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from datasets.vocabulary.state import Motion
from synth.effects.links import FlightState, FlyingBody
from synth.motion.dense_solution import DenseSolution
from synth.motion.free_flight import ATOL, RTOL, Start

Array = NDArray[np.float64]


@runtime_checkable
class Pushes(Protocol):
    """What acts on a body in flight besides the stated gravity."""

    def acceleration(self, state: FlightState) -> Array:
        """Acceleration (3,) m/s², world frame."""
        ...

    def torque_body(self, state: FlightState) -> Array:
        """Torque over the largest principal moment (3,) rad/s², body frame."""
        ...


@dataclass(frozen=True)
class PushedFlight:
    """A flight, known over the span of its ``states``; made by :func:`fly_pushed`."""

    states: DenseSolution

    def at(self, times_s: Float[NDArray[np.float64], " n"]) -> Motion:
        """The motion at ``times_s`` (s).

        Raises
        ------
        ValueError
            Where a time lies outside the span that was integrated.
        """
        t = np.asarray(times_s, dtype=np.float64)
        y = self.states(t)
        q = y[:, 9:] / np.linalg.norm(y[:, 9:], axis=1, keepdims=True)
        return Motion(t, y[:, :3], q, y[:, 3:6], Rotation.from_quat(q).apply(y[:, 6:9]))


def fly_pushed(
    start: Start,
    body: FlyingBody,
    gravity_world: Float[NDArray[np.float64], "3"],
    pushes: Pushes,
    *,
    span_s: tuple[float, float],
) -> PushedFlight:
    """Integrate the flight of ``body`` that passes through ``start`` at time zero, over ``span_s`` (earliest, latest; zero lies within)."""
    omega_body = Rotation.from_quat(start.q_world_body).inv().apply(start.omega_world)
    y0 = np.concatenate([start.x_world, start.v_world, omega_body, start.q_world_body])
    rate = _Rate(body, np.asarray(gravity_world, dtype=np.float64), pushes)
    forward, backward = (_solved(rate, y0, end) for end in (max(span_s[1], 1e-9), min(span_s[0], -1e-9)))
    return PushedFlight(DenseSolution(*span_s, forward, backward))


class _Rate:
    """The right-hand side; the state is x, v (world), w (body), q."""

    def __init__(self, body: FlyingBody, gravity: Array, pushes: Pushes) -> None:
        largest = float(body.inertia_kgm2.max())
        self._ratios, self._mass_over_moment = body.inertia_kgm2 / largest, body.mass_kg / largest
        self._gravity, self._pushes = gravity, pushes

    def __call__(self, t: float, y: Array) -> Array:
        w, q = y[6:9], y[9:]
        state = FlightState(t, y[:3], y[3:6], Rotation.from_quat(q).as_matrix(), w, self._ratios, self._mass_over_moment)
        momentum = self._ratios * w
        w_rate = (np.cross(momentum, w) + self._pushes.torque_body(state)) / self._ratios
        q_rate = 0.5 * np.concatenate([q[3] * w + np.cross(q[:3], w), [-q[:3] @ w]])
        return np.concatenate([y[3:6], self._gravity + self._pushes.acceleration(state), w_rate, q_rate])


def _solved(rate: _Rate, y0: Array, end_s: float) -> Any:
    solution = solve_ivp(rate, (0.0, end_s), y0, method="DOP853", rtol=RTOL, atol=ATOL, dense_output=True)
    if not solution.success:
        raise ArithmeticError(f"the flight could not be integrated to {end_s:g} s: {solution.message}")
    return solution.sol
