"""Flight of a body whose principal moments are all equal, under forces that do not depend on its attitude.

Then ``omega = L``, and the attitude enters nothing: positions, velocities and spins are integrated by the classical Runge-Kutta method,
however fast the body spins, in steps in which forces change velocity or spin by at most ``MAX_CHANGE`` of themselves. Rows within a step
are interpolated, velocities and spins by cubics and positions by quintics that have the rates of both ends [Hairer, Norsett and Wanner,
Solving Ordinary Differential Equations I (1993), II.6]. The attitude follows from the spin by Magnus' expansion to fourth order,

    ``Omega = h (w0 + 4 wm + w1) / 6 - h² (w0 x w1) / 12``,

w0, wm, w1 the angular velocity at the start, the middle and the end of h [Iserles et al., Acta Numerica 9 (2000) 215]; it is exact where no
torque acts. Forces that change with time have a step from row to row.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.motion.rigid_body import FASTEST_RADS, RAN_AWAY, RanAway, Rate, States, outwards, quaternion_product

Array = NDArray[np.float64]
MAX_CHANGE = 0.12
"""Relative change of velocity or spin in one step, as ``MAX_TURN_RAD`` bounds turns: wrong by 2e-7 of it a step."""
MOST_ROWS = 16
"""Of a step, however little changes."""
PROBE = 1e-4
"""Relative change of a state by which the rates of change are found."""


def is_round(inertia: Array) -> bool:
    """Whether all moments of ``inertia`` (m, 3, 3) per largest moment, body frame, are equal to the largest one."""
    return bool((inertia == np.eye(3)).all())


def round_fall(start: States, times_s: Array, *, start_time_s: float, gravity: Array) -> States:
    """Round bodies under a constant ``gravity`` (3,) m/s² alone, world frame; shapes as in :func:`estimator.motion.rigid_body.fall`.

    ``times_s`` (f,).
    """
    _check_spin(start.L)
    t = (np.asarray(times_s, dtype=np.float64) - start_time_s)[:, None, None]
    turn = _turned(start.L * t)
    return States(
        x=start.x + start.v * t + 0.5 * gravity * t**2,
        q=quaternion_product(turn, np.broadcast_to(start.q, turn.shape)),
        v=start.v + gravity * t,
        L=np.broadcast_to(start.L, (*turn.shape[:2], 3)),
    )


def round_flight(start: States, times_s: Array, *, start_time_s: float, acceleration: Rate, torque: Rate | None) -> States:
    """States (f, m, ·) at every time of m round bodies; arguments as in :func:`estimator.motion.rigid_body.propagate`; ``times_s`` (f,)."""
    with np.errstate(over="ignore", invalid="ignore"):  # of trial steps that run away
        motion, first = _motion(start, start_time_s, acceleration, torque)
        longest = motion.longest(first, times_s)
        out = States(*(np.empty((len(times_s), *a.shape)) for a in (start.x, start.q, start.v, start.L)))
        for order in outwards(times_s, start_time_s):
            here = first
            for rows in _steps(np.abs(times_s[order] - start_time_s), longest):
                there = motion.advanced(here, float(times_s[order[rows][-1]]))
                _interpolate(out, order[rows], times_s, (here, there))
                here = there
    return out


def _steps(after_s: Array, longest_s: float) -> Iterator[slice]:
    """Rows of each step, of at least one row; ``after_s`` (f,) increasing times since the start."""
    first, began = 0, 0.0
    while first < len(after_s):
        last = max(int(np.searchsorted(after_s, began + longest_s, side="right")), first + 1)
        yield slice(first, last)
        first, began = last, float(after_s[last - 1])


@dataclass(frozen=True)
class _Node:
    """A state, its acceleration (m, 3) and its torque (m, 3), ``None`` where there is none."""

    time_s: float
    state: States
    a: Array
    torque: Array | None


@dataclass(frozen=True)
class _Motion:
    """The equations of motion of a round body, and the fastest relative ``rate`` (1/s) at which forces change its motion."""

    acceleration: Rate
    torque: Rate | None
    rate: float

    def rates(self, time: float, s: States) -> tuple[Array, Array | None]:
        """Acceleration and torque."""
        return self.acceleration(time, s, s.L), None if self.torque is None else self.torque(time, s, s.L)

    def longest(self, first: _Node, times_s: Array) -> float:
        """The longest step (s); that between rows, 0, where forces change with time."""
        known = (first.a, first.torque)
        for other in (times_s.min(), times_s.mean(), times_s.max()):
            changed = self.rates(float(other), first.state)
            if any(a is not None and b is not None and not np.array_equal(a, b) for a, b in zip(known, changed, strict=True)):
                return 0.0
        return min(MAX_CHANGE / max(self.rate, 1e-12), MOST_ROWS * float(np.median(np.diff(times_s, append=times_s[-1:]))))

    def advanced(self, node: _Node, end: float) -> _Node:
        """A later or an earlier node."""
        _check_spin(node.state.L)
        steps = max(1, int(np.ceil(abs(end - node.time_s) * self.rate / MAX_CHANGE - 1e-9)))
        h, began = (end - node.time_s) / steps, node.time_s
        for number in range(steps):
            state, time = self._step(node, h), began + (number + 1) * h
            moved = _Node(time, state, *self.rates(time, state))
            q = quaternion_product(_turned(_turn(1.0, h, node, moved)), node.state.q)
            node = replace(moved, state=replace(state, q=q))
        return node

    def _step(self, node: _Node, h: float) -> States:
        """The state a step later, its attitude as before."""
        time, s, m1 = node.time_s, node.state, node.torque
        s2 = self._moved(s, s.v, (node.a, m1), h / 2)
        a2, m2 = self.rates(time + h / 2, s2)
        s3 = self._moved(s, s2.v, (a2, m2), h / 2)
        a3, m3 = self.rates(time + h / 2, s3)
        s4 = self._moved(s, s3.v, (a3, m3), h)
        a4, m4 = self.rates(time + h, s4)
        v = s.v + h / 6 * (node.a + 2 * (a2 + a3) + a4)
        x = s.x + h / 6 * (s.v + 2 * (s2.v + s3.v) + s4.v)
        if m1 is None or m2 is None or m3 is None or m4 is None:
            return States(x, s.q, v, s.L)
        return States(x, s.q, v, s.L + h / 6 * (m1 + 2 * (m2 + m3) + m4))

    @staticmethod
    def _moved(s: States, v: Array, rates: tuple[Array, Array | None], h: float) -> States:
        a, m = rates
        return States(s.x + h * v, s.q, s.v + h * a, s.L if m is None else s.L + h * m)


def _motion(s: States, time: float, acceleration: Rate, torque: Rate | None) -> tuple[_Motion, _Node]:
    """The motion with its fastest rate, found by small changes of place, velocity and spin; and its first node."""
    motion, found = _Motion(acceleration, torque, 0.0), 0.0
    a, m = motion.rates(time, s)
    for name, size in (("x", 1.0), ("v", float(np.abs(s.v).max())), ("L", float(np.abs(s.L).max()))):
        step = PROBE * max(size, 1e-3)
        for axis in np.eye(3):
            b, n = motion.rates(time, States(**{**vars(s), name: getattr(s, name) + step * axis}))
            rate = float(np.linalg.norm(b - a, axis=1).max()) / step
            own = float(np.abs(n - m).max()) / step if n is not None and m is not None and name == "L" else 0.0
            found = max(found, own, {"x": np.sqrt(rate), "v": rate, "L": 0.0}[name])
    if not found <= FASTEST_RADS:
        raise RanAway(RAN_AWAY.format(found))
    return _Motion(acceleration, torque, found), _Node(time, s, a, m)


def _interpolate(out: States, rows: NDArray[np.int64], times_s: Array, ends: tuple[_Node, _Node]) -> None:
    """Write the states of a step's rows; the last one lies at its end."""
    here, there = ends
    s, e, h = here.state, there.state, there.time_s - here.time_s
    last = rows[-1]
    out.x[last], out.q[last], out.v[last], out.L[last] = e.x, e.q, e.v, e.L
    inner = rows[:-1]
    if not len(inner):
        return
    t = ((times_s[inner] - here.time_s) / h)[:, None, None]
    out.v[inner] = _cubic(t, h, (s.v, e.v), (here.a, there.a))
    # A quintic with the position, velocity and acceleration of both ends.
    p, v, a = e.x - s.x - h * s.v - 0.5 * h**2 * here.a, h * (e.v - s.v) - h**2 * here.a, h**2 * (there.a - here.a)
    rest = t**3 * (10 * p - 4 * v + 0.5 * a + t * (-15 * p + 7 * v - a + t * (6 * p - 3 * v + 0.5 * a)))
    out.x[inner] = s.x + t * h * s.v + 0.5 * (t * h) ** 2 * here.a + rest
    out.L[inner] = s.L
    if here.torque is not None and there.torque is not None:
        out.L[inner] = _cubic(t, h, (s.L, e.L), (here.torque, there.torque))
    turn = _turn(t, h, here, there)
    out.q[inner] = quaternion_product(_turned(turn), np.broadcast_to(s.q, (*turn.shape[:2], 4)))


def _turn(t: Array | float, h: float, here: _Node, there: _Node) -> Array:
    """Rotation vectors (..., m, 3) over the shares ``t`` of a step ``h``."""
    first = here.state.L
    if here.torque is None or there.torque is None:
        return t * h * first
    ends, rates = (first, there.state.L), (here.torque, there.torque)
    middle, last = _cubic(0.5 * t, h, ends, rates), _cubic(t, h, ends, rates)
    return np.asarray(t * h / 6 * (first + 4 * middle + last) - (t * h) ** 2 / 12 * np.cross(first, last))


def _cubic(t: Array | float, h: float, values: tuple[Array, Array], rates: tuple[Array, Array]) -> Array:
    """Hermite's cubic at the shares ``t`` of a step ``h``."""
    (y0, y1), (d0, d1) = values, rates
    change = y1 - y0
    return np.asarray(y0 + t * (h * d0 + t * (3 * change - h * (2 * d0 + d1) + t * (h * (d0 + d1) - 2 * change))))


def _turned(turn: Array) -> Array:
    """Quaternions (..., 4) of rotation vectors (..., 3)."""
    angle = np.sqrt(np.sum(turn**2, axis=-1, keepdims=True))
    return np.concatenate([0.5 * np.sinc(angle / (2 * np.pi)) * turn, np.cos(0.5 * angle)], axis=-1)


def _check_spin(L: Array) -> None:
    spin = float(np.sqrt(np.max(np.sum(L**2, axis=1))))
    if not spin <= FASTEST_RADS:
        raise RanAway(RAN_AWAY.format(spin))
