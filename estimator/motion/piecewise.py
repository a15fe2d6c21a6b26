"""Flights with impacts between them: one pose at each impact, velocities before and after it, and a continuous time of impact.

A contact of microseconds is an instant here: position of the centre of mass and orientation go on through it, velocity and angular
velocity jump to values of their own. So every impact adds blocks to those of the first flight (:data:`estimator.motion.flight.LAYOUT`):
its time (s), and v (3, m/s) and omega (3, rad/s) right after it, world frame. An impact that was more than one contact may have another
pose after it than before it, and a block for that (:mod:`estimator.impacts.loose_contact`).

The poses of all later frames depend on a time of impact through both segments. Its central differences start the second segment at
``t ± h`` and fly it back to ``t``, from where all perturbed flights go on together; a frame within ``h`` of the impact is where the
derivative jumps, and gets that of the second segment.

Not meant for contacts that last longer than a small part of a frame, nor for particles that rest or roll.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.motion.blocks import Block, Layout
from estimator.motion.flight import (
    COM,
    INERTIA,
    LAYOUT,
    N_PARAMETERS,
    Flight,
    FlightPoses,
    inertia_matrix,
    perturbations,
    pose_differences,
    rates,
)
from estimator.motion.flight import states as flight_states
from estimator.motion.rigid_body import (
    RanAway,
    States,
    angular_momentum,
    angular_velocity,
    fall,
    inverted,
    quaternion_product,
    rotation_matrices,
)
from estimator.motion.rotation import quaternion_from_vector

Array = NDArray[np.float64]
TIME_STEP_S = 1e-7
"""For difference quotients by the time of an impact, and by a shift of its pose in units of time."""


@dataclass(frozen=True)
class Loose:
    """By ``basis`` (6, c) times z (c,) s the pose after an impact may be off; ``spread_s``: standard deviation of z about zero."""

    basis: Float[NDArray[np.float64], "6 c"]
    spread_s: float


@dataclass(frozen=True)
class Bounce:
    """An impact at ``time_s`` and the velocities that a particle leaves it with: ``v`` (3,) m/s, ``omega`` (3,) rad/s, world frame.

    ``shift`` (6,): by how much (m, rad as a left rotation vector) the pose it leaves with is off the one it came with, where the impact was
    more than one contact and the particle moved on between them; ``loose`` where that is fitted.
    """

    time_s: float
    v: Float[NDArray[np.float64], "3"]
    omega: Float[NDArray[np.float64], "3"]
    shift: Float[NDArray[np.float64], "6"] = field(default_factory=lambda: np.zeros(6))
    loose: Loose | None = None


@dataclass(frozen=True)
class PiecewiseFlight:
    """The ``first`` flight, whose reference time lies before the first impact, and the impacts in order of time."""

    first: Flight
    bounces: tuple[Bounce, ...]

    @cached_property
    def layout(self) -> Layout:
        """The blocks of the first flight, then those of every impact."""
        return Layout((*LAYOUT.blocks, *(block for number, bounce in enumerate(self.bounces) for block in _blocks(number, bounce))))

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.layout.size

    @property
    def values(self) -> Array:
        """Parameters (p,), that of a shift as z (s)."""
        parts = [self.first.values]
        for bounce in self.bounces:
            parts += [np.array([bounce.time_s]), bounce.v, bounce.omega]
            parts += [] if bounce.loose is None else [np.linalg.pinv(bounce.loose.basis) @ bounce.shift]
        return np.concatenate(parts)

    @property
    def times_s(self) -> Array:
        """Times (k,) s of the impacts."""
        return np.array([b.time_s for b in self.bounces])

    def moved(self, step: Array) -> "PiecewiseFlight":
        """The flight after a parameter step (p,)."""
        bounces = []
        for number, bounce in enumerate(self.bounces):
            time_s, v, omega = (step[self.layout[named(part, number)]] for part in (TIME, "v", "omega"))
            moved = replace(bounce, time_s=bounce.time_s + float(time_s[0]), v=bounce.v + v, omega=bounce.omega + omega)
            bounces.append(replace(moved, shift=_shifts(self, step[None], number)[0]))
        return PiecewiseFlight(self.first.moved(step[:N_PARAMETERS]), tuple(bounces))

    def with_first(self, first: Flight) -> "PiecewiseFlight":
        """With another flight before the impacts."""
        return replace(self, first=first)

    def states(self, steps: Array, times_s: Array) -> States:
        """See :func:`piecewise_states`; ``steps`` (m, p), ``times_s`` (f,)."""
        return piecewise_states(self, steps, times_s)


TIME, SHIFT = "time", "shift"


def named(part: str, number: int) -> str:
    """The name of a block of impact ``number`` (from 0)."""
    return f"impact_{number + 1}_{part}"


def _blocks(number: int, bounce: Bounce) -> list[Block]:
    time = Block(named(TIME, number), (named("time_s", number),), TIME_STEP_S)
    rates = [
        replace(block, name=named(block.name, number), labels=tuple(named(label, number) for label in block.labels)) for block in RATES
    ]
    if bounce.loose is None:
        return [time, *rates]
    labels = tuple(named(f"shift_{k + 1}_s", number) for k in range(bounce.loose.basis.shape[1]))
    return [time, *rates, Block(named(SHIFT, number), labels, TIME_STEP_S, bounce.loose.spread_s**-2)]


RATES = tuple(block for block in LAYOUT.blocks if block.name in {"v", "omega"})


def _shifts(flight: PiecewiseFlight, steps: Array, number: int) -> Array:
    """Shifts (m, 6) at impact ``number`` of the flights reached by the parameter steps (m, p)."""
    bounce = flight.bounces[number]
    if bounce.loose is None:
        return np.broadcast_to(bounce.shift, (len(steps), 6))
    return bounce.shift + steps[:, flight.layout[named(SHIFT, number)]] @ bounce.loose.basis.T


@dataclass(frozen=True)
class _Leg:
    """One segment of m perturbed flights: their states (m, ·) at ``time_s``."""

    start: States
    time_s: float


@dataclass(frozen=True)
class _Lanes:
    """m perturbed ``flight`` s side by side: ``steps`` (m, p) and their ``inertia`` and its inverse (m, 3, 3)."""

    flight: PiecewiseFlight
    steps: Array
    inertia: Array
    inverse: Array

    def take(self, rows: NDArray[np.int64]) -> "_Lanes":
        return _Lanes(self.flight, self.steps[rows], self.inertia[rows], self.inverse[rows])

    def part(self, name: str, number: int) -> Array:
        """Steps (m, c) of a block of impact ``number``."""
        return self.steps[:, self.flight.layout[named(name, number)]]


def _lanes(flight: PiecewiseFlight, steps: Array) -> _Lanes:
    inertia = inertia_matrix(flight.first, flight.first.inertia + steps[:, INERTIA])
    return _Lanes(flight, steps, inertia, inverted(inertia))


def _flown(leg: _Leg, lanes: _Lanes, times_s: Array) -> States:
    return fall(leg.start, lanes.inverse, times_s, start_time_s=leg.time_s, gravity=lanes.flight.first.gravity_world)


def _first_leg(flight: PiecewiseFlight, lanes: _Lanes) -> _Leg:
    at = flight_states(flight.first, lanes.steps[:, :N_PARAMETERS], np.array([flight.first.time_s]))
    return _Leg(_row(at, 0), flight.first.time_s)


def _row(states: States, index: int | NDArray[np.int64]) -> States:
    return States(states.x[index], states.q[index], states.v[index], states.L[index])


def _struck(before: _Leg, lanes: _Lanes, number: int) -> _Leg:
    """The leg after an impact; flights that are hit at another time are flown back (or on) to the nominal one."""
    bounce, shifts, times = lanes.flight.bounces[number], _shifts(lanes.flight, lanes.steps, number), lanes.part(TIME, number)[:, 0]
    v, omega = bounce.v + lanes.part("v", number), bounce.omega + lanes.part("omega", number)
    start = States(*(np.empty_like(a) for a in (before.start.x, before.start.q, before.start.v, before.start.L)))
    for later in np.unique(times):
        rows = np.flatnonzero(times == later)
        group, time_s = lanes.take(rows), bounce.time_s + float(later)
        touched = _shifted(_reached(before, group, rows, time_s), shifts[rows])
        after = States(touched.x, touched.q, v[rows], angular_momentum(touched.q, omega[rows], group.inertia))
        if later != 0.0:
            after = _row(_flown(_Leg(after, time_s), group, np.array([bounce.time_s])), 0)
        start.x[rows], start.q[rows], start.v[rows], start.L[rows] = after.x, after.q, after.v, after.L
    return _Leg(start, bounce.time_s)


def _reached(leg: _Leg, group: _Lanes, rows: NDArray[np.int64], time_s: float) -> States:
    """Where the flights ``rows`` of a leg, which are ``group``, are at a time."""
    return _row(_flown(_Leg(_row(leg.start, rows), leg.time_s), group, np.array([time_s])), 0)


def _shifted(states: States, shifts: Array) -> States:
    if not shifts.any():
        return states
    return States(states.x + shifts[:, :3], quaternion_product(quaternion_from_vector(shifts[:, 3:]), states.q), states.v, states.L)


def _legs(flight: PiecewiseFlight, lanes: _Lanes) -> list[_Leg]:
    if np.any(np.diff([flight.first.time_s, *flight.times_s]) <= 0.0):
        raise RanAway("a flight ran away: its impacts are not in order")
    legs = [_first_leg(flight, lanes)]
    for number in range(len(flight.bounces)):
        legs.append(_struck(legs[-1], lanes, number))
    return legs


def segment_of(flight: PiecewiseFlight, times_s: Array) -> NDArray[np.int64]:
    """Number of the segment in which each of ``times_s`` (f,) lies; a time of impact belongs to the segment after it."""
    return np.searchsorted(flight.times_s, times_s, side="right").astype(np.int64)


def piecewise_states(flight: PiecewiseFlight, steps: Array, times_s: Array) -> States:
    """States (f, m, ·) at ``times_s`` (f,) of the flights reached by the parameter steps (m, p)."""
    lanes = _lanes(flight, steps)
    segment = segment_of(flight, times_s)
    shape = (len(times_s), len(steps))
    out = States(*(np.empty((*shape, width)) for width in (3, 4, 3, 3)))
    for number, leg in enumerate(_legs(flight, lanes)):
        rows = np.flatnonzero(segment == number)
        part = _flown(leg, lanes, times_s[rows])
        out.x[rows], out.q[rows], out.v[rows], out.L[rows] = part.x, part.q, part.v, part.L
    return out


piecewise_velocities = rates
"""Velocity and angular velocity (f, m, 6), world frame, at f times of the flights reached by m parameter steps."""


@dataclass(frozen=True)
class Touch:
    """What m perturbed flights are like at an impact, world frame.

    ``x`` (m, 3) m of the centre of mass, ``R`` (m, 3, 3) world from nominal body axes, ``before`` and ``after`` (m, 6): v (m/s) and
    omega (rad/s).
    """

    x: Array
    R: Array
    before: Array
    after: Array


def _touches(flight: PiecewiseFlight, steps: Array, number: int) -> Touch:
    """The impact ``number`` as each perturbed flight has it, at its own time."""
    lanes = _lanes(flight, steps)
    leg, bounce, times = _legs(flight, lanes)[number], flight.bounces[number], lanes.part(TIME, number)[:, 0]
    m = len(steps)
    x, R, before = np.empty((m, 3)), np.empty((m, 3, 3)), np.empty((m, 6))
    for later in np.unique(times):
        rows = np.flatnonzero(times == later)
        group = lanes.take(rows)
        at = _reached(leg, group, rows, bounce.time_s + float(later))
        x[rows], R[rows] = at.x, rotation_matrices(at.q)
        before[rows] = np.hstack([at.v, angular_velocity(at.q, at.L, group.inverse)])
    return Touch(x, R, before, np.hstack([bounce.v + lanes.part("v", number), bounce.omega + lanes.part("omega", number)]))


POSE, BEFORE, AFTER = slice(0, 6), slice(6, 12), slice(12, 18)
"""Rows of what is told of an impact: position and left rotation vector, velocities before and after it."""


def touch_and_sensitivity(flight: PiecewiseFlight, number: int) -> tuple[Touch, Array]:
    """Impact ``number`` (m = 1) and the sensitivity (18, p) of position, left rotation vector, velocities before and after it."""
    varied, steps, widths = perturbations(flight.layout)
    every = _touches(flight, steps, number)
    result = np.zeros((18, flight.size))
    result[POSE, varied] = pose_differences(FlightPoses(every.x[None], every.R[None]), widths)[0]
    for part, values in ((BEFORE, every.before), (AFTER, every.after)):
        result[part, varied] = ((values[1::2] - values[2::2]) / widths[:, None]).T
    return Touch(every.x[:1], every.R[:1], every.before[:1], every.after[:1]), result


def moves_at(S: Array, arm: Array) -> Array:
    """How a place at ``arm`` (3,) m, world frame, from a centre moves (3, p) with the sensitivity ``S`` (6, p) of the pose."""
    return np.asarray(S[:3] + np.cross(S[3:6].T, arm).T)


def moves_of_place(touch: Touch, J: Array, arm: Array) -> Array:
    """How a place of the body moves (3, p) at an impact, ``arm`` (3,) m, world frame, off its centre of mass; ``J`` (18, p)."""
    moves = moves_at(J[POSE], arm)
    moves[:, COM] -= touch.R[0]
    return moves
