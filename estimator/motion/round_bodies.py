"""Flight of a body whose principal moments are all equal, under forces that do not depend on its attitude.

Then ``omega = L``, and the attitude enters nothing: positions, velocities and spins are integrated by the classical Runge-Kutta method with
a step from row to row, however fast the body spins, and the attitude follows from the spin by Magnus' expansion to the fourth order,

    ``Omega = h (w0 + 4 wm + w1) / 6 - h² (w0 x w1) / 12``,

w0, wm, w1 the angular velocity at the start, the middle and the end of a step [Iserles et al., Acta Numerica 9 (2000) 215]; it is exact
where no torque acts. A step is split where forces change the velocity or the spin by more than ``MAX_CHANGE`` of itself in one.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.motion.rigid_body import FASTEST_RADS, RAN_AWAY, RanAway, Rate, States, outwards, quaternion_product
from estimator.motion.rotation import quaternion_from_vector

Array = NDArray[np.float64]
MAX_CHANGE = 0.12
"""Relative change of velocity or spin in one step, as ``MAX_TURN_RAD`` bounds turns: wrong by 2e-7 of it a step."""
PROBE = 1e-4
"""Relative change of a state by which the rates of change are found."""


def is_round(inertia: Array) -> bool:
    """Whether all moments of inertias (m, 3, 3) are equal to the largest one."""
    return bool((inertia == np.eye(3)).all())


def round_fall(start: States, times_s: Array, *, start_time_s: float, gravity: Array) -> States:
    """Round bodies under a constant ``gravity`` (3,) m/s² alone, in closed form; shapes as in :func:`estimator.motion.rigid_body.fall`."""
    _check_spin(start.L)
    t = (np.asarray(times_s, dtype=np.float64) - start_time_s)[:, None, None]
    turn = quaternion_from_vector((start.L * t).reshape(-1, 3)).reshape(*np.broadcast_shapes(start.L.shape, t.shape)[:2], 4)
    return States(
        x=start.x + start.v * t + 0.5 * gravity * t**2,
        q=quaternion_product(turn, np.broadcast_to(start.q, turn.shape)),
        v=start.v + gravity * t,
        L=np.broadcast_to(start.L, (*turn.shape[:2], 3)),
    )


def round_flight(start: States, times_s: Array, *, start_time_s: float, acceleration: Rate, torque: Rate | None) -> States:
    """States (f, m, ·) at every time of m round bodies; arguments as in :func:`estimator.motion.rigid_body.propagate`."""
    motion = _Motion(start, start_time_s, acceleration, torque)
    out = States(*(np.empty((len(times_s), *a.shape)) for a in (start.x, start.q, start.v, start.L)))
    for order in outwards(times_s, start_time_s):
        state, time = start, start_time_s
        for i in order:
            end = float(times_s[i])
            with np.errstate(over="ignore", invalid="ignore"):  # of trial steps that run away
                state = motion.advanced(state, time, end)
            time = end
            out.x[i], out.q[i], out.v[i], out.L[i] = state.x, state.q, state.v, state.L
    return out


class _Motion:
    """The equations of motion of a round body, and how long steps may be."""

    def __init__(self, start: States, start_time_s: float, acceleration: Rate, torque: Rate | None) -> None:
        self._acceleration, self._torque = acceleration, torque
        with np.errstate(over="ignore", invalid="ignore"):  # of trial steps that run away
            self._rate = self._fastest(start, start_time_s)

    def advanced(self, state: States, time: float, end: float) -> States:
        """The state at a later or an earlier time."""
        _check_spin(state.L)
        steps = max(1, int(np.ceil(abs(end - time) * self._rate / MAX_CHANGE)))
        h = (end - time) / steps
        for number in range(steps if h else 0):
            state = self._step(state, time + number * h, h)
        return state

    def _step(self, s: States, time: float, h: float) -> States:
        a1, m1 = self._rates(time, s)
        s2 = self._moved(s, s.v, (a1, m1), h / 2)
        a2, m2 = self._rates(time + h / 2, s2)
        s3 = self._moved(s, s2.v, (a2, m2), h / 2)
        a3, m3 = self._rates(time + h / 2, s3)
        s4 = self._moved(s, s3.v, (a3, m3), h)
        a4, m4 = self._rates(time + h, s4)
        v = s.v + h / 6 * (a1 + 2 * (a2 + a3) + a4)
        x = s.x + h / 6 * (s.v + 2 * (s2.v + s3.v) + s4.v)
        if m1 is None or m2 is None or m3 is None or m4 is None:
            L, turn = s.L, h * s.L
        else:
            L = s.L + h / 6 * (m1 + 2 * (m2 + m3) + m4)
            turn = h / 6 * (s.L + 2 * (s2.L + s3.L) + L) - h**2 / 12 * np.cross(s.L, L)
        return States(x, quaternion_product(_turned(turn), s.q), v, L)

    def _rates(self, time: float, s: States) -> tuple[Array, Array | None]:
        return self._acceleration(time, s, s.L), None if self._torque is None else self._torque(time, s, s.L)

    @staticmethod
    def _moved(s: States, v: Array, rates: tuple[Array, Array | None], h: float) -> States:
        a, m = rates
        return States(s.x + h * v, s.q, s.v + h * a, s.L if m is None else s.L + h * m)

    def _fastest(self, s: States, time: float) -> float:
        """The fastest relative rate (1/s) at which forces change velocity and spin, by small changes of place, velocity and spin."""
        found = 0.0
        a, m = self._rates(time, s)
        for name, size in (("x", 1.0), ("v", float(np.abs(s.v).max())), ("L", float(np.abs(s.L).max()))):
            step = PROBE * max(size, 1e-3)
            for axis in np.eye(3):
                changed = States(**{**vars(s), name: getattr(s, name) + step * axis})
                b, n = self._rates(time, changed)
                own = float(np.abs(n - m).max()) / step if n is not None and m is not None and name == "L" else 0.0
                rate = float(np.linalg.norm(b - a, axis=1).max()) / step
                found = max(found, own, {"x": np.sqrt(rate), "v": rate, "L": 0.0}[name])
        if not found <= FASTEST_RADS:
            raise RanAway(RAN_AWAY.format(found))
        return found


def _turned(turn: Array) -> Array:
    """Quaternions (m, 4) of rotation vectors (m, 3)."""
    angle = np.sqrt(np.sum(turn**2, axis=1, keepdims=True))
    return np.concatenate([0.5 * np.sinc(angle / (2 * np.pi)) * turn, np.cos(0.5 * angle)], axis=1)


def _check_spin(L: Array) -> None:
    spin = float(np.sqrt(np.max(np.sum(L**2, axis=1))))
    if not spin <= FASTEST_RADS:
        raise RanAway(RAN_AWAY.format(spin))
