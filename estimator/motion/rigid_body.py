"""Free flight of a rigid body by the classical Runge-Kutta method of fourth order, over many trajectories at once.

State Y = [x, Q, P, L] [Mirtich 1996]; mass and one moment of inertia cannot be seen in free flight, so P is per unit mass (v) and L per
unit of the largest moment. ``dx/dt = v``, ``dQ/dt = (omega, 0) Q / 2`` with ``omega = R J⁻¹ Rᵀ L``, ``dv/dt = a``, ``dL/dt = torque``.

At 300 rad/s and 4000 frames/s one step per frame is wrong by 2e-8 rad a step; steps are split where the body turns further than
``MAX_TURN_RAD`` in one.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MAX_TURN_RAD = 0.12
"""In one step; a step's error grows with the fifth power of its turn (above)."""
FASTEST_RADS = 1e6
"""A spin above it is no flight of a particle that a camera can follow: a fit has gone astray, and its steps would have no end."""
FOLLOWED_RAD, FEWEST_ROWS = 30.0, 30
"""Turn from one row to the next, in the mean over all rows or so many, that is none that they follow: some five turns. A law of torques
that is tried on 50 rows of a gyroscope went on for minutes, in steps of a spin that had run away."""


@dataclass(frozen=True)
class States:
    """m states side by side, world frame.

    ``x`` (m, 3) m, ``q`` (m, 4) world from body, scalar last, ``v`` (m, 3) m/s, ``L`` (m, 3) rad/s: angular momentum per largest moment.
    """

    x: Array
    q: Array
    v: Array
    L: Array


class RanAway(ValueError):
    """A flight whose spin or attitude is no number, or none that can be followed: its inertia is impossible, or its steps were too far."""


RAN_AWAY = "a flight ran away: it spins with {:g} rad/s"
Rate = Callable[[float, States, Array], Array]
"""A rate (m, 3) at a time (s) in m states with the angular velocities (m, 3) rad/s, world frame: acceleration (m/s²) of the centre of
mass, or torque per largest moment (rad/s²)."""


def rotation_matrices(q: Array) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions ``q`` (..., 4), scalar last."""
    R = np.empty((*q.shape[:-1], 3, 3))
    _rotation_matrices(np.ascontiguousarray(q).reshape(-1, 4), R.reshape(-1, 9))
    return R


@numba.njit(cache=True)
def _rotation_matrices(q, R):  # type: ignore[no-untyped-def]
    for i in range(len(q)):
        x, y, z, w = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
        R[i, 0], R[i, 1], R[i, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
        R[i, 3], R[i, 4], R[i, 5] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
        R[i, 6], R[i, 7], R[i, 8] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


def quaternion_product(a: Array, b: Array) -> Array:
    """The product (..., 4) of quaternions ``a``, ``b`` (..., 4), scalar last: first ``b``'s rotation, then ``a``'s."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    first, second = (np.ascontiguousarray(np.broadcast_to(each, out.shape), dtype=np.float64).reshape(-1, 4) for each in (a, b))
    _quaternion_product(first, second, out.reshape(-1, 4))
    return out


@numba.njit(cache=True)
def _quaternion_product(a, b, out):  # type: ignore[no-untyped-def]
    for i in range(len(a)):
        x, y, z, w = a[i, 0], a[i, 1], a[i, 2], a[i, 3]
        p, q, r, s = b[i, 0], b[i, 1], b[i, 2], b[i, 3]
        out[i, 0] = w * p + s * x + (y * r - z * q)
        out[i, 1] = w * q + s * y + (z * p - x * r)
        out[i, 2] = w * r + s * z + (x * q - y * p)
        out[i, 3] = w * s - (x * p + y * q + z * r)


def cross_product(a: Array, b: Array) -> Array:
    """The cross product (m, 3) of vectors ``a``, ``b`` (m, 3), any units, one frame."""
    out = np.empty(np.shape(b))
    _cross_product(np.ascontiguousarray(a), np.ascontiguousarray(b), out)
    return out


@numba.njit(cache=True)
def _cross_product(a, b, out):  # type: ignore[no-untyped-def]
    for i in range(len(a)):
        out[i, 0] = a[i, 1] * b[i, 2] - a[i, 2] * b[i, 1]
        out[i, 1] = a[i, 2] * b[i, 0] - a[i, 0] * b[i, 2]
        out[i, 2] = a[i, 0] * b[i, 1] - a[i, 1] * b[i, 0]


def sizes(a: Array) -> Array:
    """Lengths (m, 1) of vectors ``a`` (m, n), any units and frame."""
    out = np.empty((len(a), 1))
    _sizes(np.ascontiguousarray(a), out)
    return out


@numba.njit(cache=True)
def _sizes(a, out):  # type: ignore[no-untyped-def]
    for i in range(len(a)):
        square = 0.0
        for j in range(a.shape[1]):
            square += a[i, j] ** 2
        out[i, 0] = np.sqrt(square)


def angular_velocity(q: Array, L: Array, inverse_inertia: Array) -> Array:
    """World-frame angular velocity (m, 3) rad/s; ``inverse_inertia`` (m, 3, 3) per largest moment, body frame.

    ``q`` (m, 4), scalar last; ``L`` (m, 3) per largest moment.
    """
    omega = np.empty(L.shape)
    _attitude_rates(*(np.ascontiguousarray(a) for a in (q, L, inverse_inertia)), omega, np.empty(q.shape))
    return omega


@numba.njit(cache=True)
def _attitude_rates(q, L, inverse_inertia, omega, q_rate):  # type: ignore[no-untyped-def]
    """``omega = R J⁻¹ Rᵀ L`` and ``dQ/dt = (omega, 0) Q / 2``, written into the last two arguments."""
    R, in_body, turning = np.empty((1, 9)), np.empty(3), np.empty(3)
    for i in range(len(q)):
        _rotation_matrices(q[i : i + 1], R)
        for a in range(3):
            in_body[a] = R[0, a] * L[i, 0] + R[0, 3 + a] * L[i, 1] + R[0, 6 + a] * L[i, 2]
        J = inverse_inertia[i]
        for a in range(3):
            turning[a] = J[a, 0] * in_body[0] + J[a, 1] * in_body[1] + J[a, 2] * in_body[2]
        for a in range(3):
            omega[i, a] = R[0, 3 * a] * turning[0] + R[0, 3 * a + 1] * turning[1] + R[0, 3 * a + 2] * turning[2]
        ox, oy, oz = omega[i, 0], omega[i, 1], omega[i, 2]
        x, y, z, scalar = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
        q_rate[i, 0] = 0.5 * (scalar * ox + oy * z - oz * y)
        q_rate[i, 1] = 0.5 * (scalar * oy + oz * x - ox * z)
        q_rate[i, 2] = 0.5 * (scalar * oz + ox * y - oy * x)
        q_rate[i, 3] = -0.5 * (ox * x + oy * y + oz * z)


def angular_momentum(q: Array, omega: Array, inertia: Array) -> Array:
    """World-frame angular momentum (m, 3) per largest moment, of the angular velocity ``omega`` (m, 3) rad/s.

    ``q`` (m, 4), scalar last; ``inertia`` (m, 3, 3) per largest moment, body frame.
    """
    R = rotation_matrices(q)
    omega_body = (omega[:, None, :] @ R)[:, 0, :]
    return np.asarray((R @ (inertia @ omega_body[:, :, None]))[:, :, 0])


@dataclass(frozen=True)
class _Body:
    inverse_inertia: Array
    acceleration: Rate
    torque: Rate | None


def propagate(
    start: States, inverse_inertia: Array, times_s: Array, *, start_time_s: float, acceleration: Rate, torque: Rate | None = None
) -> States:
    """States at every time: each array gets a leading axis over ``times_s``; times before the start are reached backwards.

    ``start`` holds m states at ``start_time_s``; ``inverse_inertia`` (m, 3, 3) per largest moment, body frame; ``times_s`` (f,). Without
    ``torque`` L stays as it is.
    """
    body = _Body(np.ascontiguousarray(inverse_inertia), acceleration, torque)
    start = States(*(np.ascontiguousarray(a) for a in (start.x, start.q, start.v, start.L)))
    shape = (len(times_s), len(start.x))
    out = States(*(np.empty((*shape, a.shape[1])) for a in (start.x, start.q, start.v, start.L)))
    left_rad = FOLLOWED_RAD * max(len(times_s), FEWEST_ROWS)
    for order in outwards(times_s, start_time_s):
        state, time = start, start_time_s
        for i in order:
            with np.errstate(over="ignore", invalid="ignore"):  # of trial steps that run away
                left_rad -= abs(float(times_s[i]) - time) * (spin := _spin(state, body))
                if not (spin <= FASTEST_RADS and left_rad >= 0.0):
                    raise RanAway(RAN_AWAY.format(spin))
                state = _advance(state, body, (time, float(times_s[i])), spin)
            time = float(times_s[i])
            out.x[i], out.q[i], out.v[i], out.L[i] = state.x, state.q, state.v, state.L
    return replace(out, q=_attitudes(out.q))


def outwards(times_s: Array, start_time_s: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of the times from the start on, and of those before it, the nearest first; ``times_s`` (f,)."""
    return np.flatnonzero(times_s >= start_time_s), np.flatnonzero(times_s < start_time_s)[::-1]


def fall(start: States, inverse_inertia: Array, times_s: Array, *, start_time_s: float, gravity: Array) -> States:
    """What :func:`propagate` does under a constant ``gravity`` (3,) m/s² alone: positions and velocities are known in closed form.

    ``inverse_inertia`` (m, 3, 3) per largest moment, body frame; ``times_s`` (f,); gravity in the world frame.
    """
    times = np.asarray(times_s, dtype=np.float64)
    shape = (len(times), len(start.x))
    t = (times - start_time_s)[:, None, None]
    q = np.full((*shape, 4), np.nan)
    L, inverse = np.ascontiguousarray(start.L), np.ascontiguousarray(inverse_inertia)
    for order in outwards(times, start_time_s):
        spin = _turned((np.ascontiguousarray(start.q), L, inverse), np.concatenate([[start_time_s], times[order]]), order, q)
        if not spin <= FASTEST_RADS:
            raise RanAway(RAN_AWAY.format(spin))
    return States(
        x=start.x + start.v * t + 0.5 * gravity * t**2,
        q=_attitudes(q),
        v=start.v + gravity * t,
        L=np.broadcast_to(start.L, (*shape, 3)),
    )


def inverted(inertia: Array) -> Array:
    """Inverses (m, 3, 3) of ``inertia`` (m, 3, 3) per largest moment, body frame, which a flight that ran away may not have."""
    try:
        return np.asarray(np.linalg.inv(inertia), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise RanAway("a flight ran away: its inertia has no inverse") from None


def _attitudes(q: Array) -> Array:
    """Attitudes that are numbers; within one interval a flight may run away from spins that were none too fast."""
    if not np.isfinite(q).all():
        raise RanAway("a flight ran away: its attitude is no number")
    return q


@numba.njit(cache=True)
def _turned(start, times, order, out):  # type: ignore[no-untyped-def]
    """Attitudes at ``times[1:]``, written into the rows ``order`` of ``out``; returns a spin that ran away, where it stops, or 0."""
    q, L, inverse_inertia = start
    k1, k2, k3, k4, omega = np.empty_like(q), np.empty_like(q), np.empty_like(q), np.empty_like(q), np.empty_like(L)
    for i in range(len(order)):
        duration = times[i + 1] - times[i]
        _attitude_rates(q, L, inverse_inertia, omega, k1)
        spin = np.sqrt(np.max(np.sum(omega**2, axis=1)))
        if not spin <= FASTEST_RADS:
            return spin
        steps = max(1, int(np.ceil(abs(duration) * spin / MAX_TURN_RAD)))
        h = duration / steps
        for step in range(steps if duration != 0.0 else 0):
            if step > 0:
                _attitude_rates(q, L, inverse_inertia, omega, k1)
            _attitude_rates(q + (h / 2) * k1, L, inverse_inertia, omega, k2)
            _attitude_rates(q + (h / 2) * k2, L, inverse_inertia, omega, k3)
            _attitude_rates(q + h * k3, L, inverse_inertia, omega, k4)
            q = q + h * ((k1 + 2 * k2 + 2 * k3 + k4) / 6)
            for m in range(len(q)):
                q[m] /= np.sqrt(np.sum(q[m] ** 2))
        out[order[i]] = q
    return 0.0


def _spin(state: States, body: _Body) -> float:
    """The fastest, rad/s."""
    return float(sizes(angular_velocity(state.q, state.L, body.inverse_inertia)).max())


def _advance(state: States, body: _Body, span: tuple[float, float], spin: float) -> States:
    time, end = span
    if end == time:
        return state
    steps = max(1, int(np.ceil(abs(end - time) * spin / MAX_TURN_RAD)))
    h = (end - time) / steps
    for _ in range(steps):
        state = _rk4_step(state, body, time, h)
        time += h
    return state


_Rates = tuple[Array, Array, Array, Array | None]


def _rates(state: States, body: _Body, time: float) -> _Rates:
    omega, q_rate = np.empty_like(state.L), np.empty_like(state.q)
    _attitude_rates(state.q, state.L, body.inverse_inertia, omega, q_rate)
    torque = None if body.torque is None else body.torque(time, state, omega)
    return state.v, q_rate, body.acceleration(time, state, omega), torque


def _shifted(state: States, rates: _Rates, h: float) -> States:
    L = state.L if rates[3] is None else state.L + h * rates[3]
    return States(state.x + h * rates[0], state.q + h * rates[1], state.v + h * rates[2], L)


def _rk4_step(state: States, body: _Body, time: float, h: float) -> States:
    k1 = _rates(state, body, time)
    k2 = _rates(_shifted(state, k1, h / 2), body, time + h / 2)
    k3 = _rates(_shifted(state, k2, h / 2), body, time + h / 2)
    k4 = _rates(_shifted(state, k3, h), body, time + h)
    dx, dq, dv = ((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1[:3], k2[:3], k3[:3], k4[:3], strict=True))
    dL = None
    if k1[3] is not None and k2[3] is not None and k3[3] is not None and k4[3] is not None:
        dL = (k1[3] + 2 * k2[3] + 2 * k3[3] + k4[3]) / 6
    new = _shifted(state, (dx, dq, dv, dL), h)
    return States(new.x, new.q / sizes(new.q), new.v, new.L)
