"""Flights with impacts between them: one pose at each impact, velocities before and after it, and a continuous time of impact.

A contact of microseconds is an instant here: position of the centre of mass and orientation go on through it, velocity and angular
velocity jump to values of their own. So ``k`` impacts add to the 21 parameters of the first flight, whose table is in
:mod:`estimator.motion.flight`, seven each: the time (s), and v (3, m/s) and omega (3, rad/s) right after it, world frame.

The poses of all later frames depend on a time of impact through both segments. Its central differences start the second segment at
``t ± h`` and fly it back to ``t``, from where all perturbed flights go on together; a frame within ``h`` of the impact is where the
derivative jumps, and gets that of the second segment.

Not meant for contacts that last longer than a small part of a frame, nor for particles that rest or roll.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.motion.flight import (
    COM,
    INERTIA,
    N_PARAMETERS,
    OMEGA,
    STEPS,
    Flight,
    FlightPoses,
    V,
    inertia_matrix,
    moved,
    pose_differences,
)
from estimator.motion.flight import NAMES as FLIGHT_NAMES
from estimator.motion.flight import states as flight_states
from estimator.motion.rigid_body import (
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
PER_IMPACT = 7
"""Parameters of an impact: its time, and velocity and spin after it."""
TIME_STEP_S = 1e-7
"""For difference quotients by the time of an impact."""
IMPACT_STEPS = np.array([TIME_STEP_S, *STEPS[V], *STEPS[OMEGA]])


@dataclass(frozen=True)
class Bounce:
    """An impact at ``time_s`` and the velocities that a particle leaves it with: ``v`` (3,) m/s, ``omega`` (3,) rad/s, world frame.

    ``shift`` (6,): by how much (m, rad as a left rotation vector) the pose it leaves with is off the one it came with, where the impact was
    more than one contact and the particle moved on between them.
    """

    time_s: float
    v: Float[NDArray[np.float64], "3"]
    omega: Float[NDArray[np.float64], "3"]
    shift: Float[NDArray[np.float64], "6"] = field(default_factory=lambda: np.zeros(6))


@dataclass(frozen=True)
class PiecewiseFlight:
    """The ``first`` flight, whose reference time lies before the first impact, and the impacts in order of time."""

    first: Flight
    bounces: tuple[Bounce, ...]

    @property
    def size(self) -> int:
        """Number of parameters."""
        return N_PARAMETERS + PER_IMPACT * len(self.bounces)

    @property
    def times_s(self) -> Array:
        """Times (k,) s of the impacts."""
        return np.array([b.time_s for b in self.bounces])


def names(flight: PiecewiseFlight) -> tuple[str, ...]:
    """Names of the parameters, in order."""
    parts = ("time_s", "v_x_ms", "v_y_ms", "v_z_ms", "omega_x_rads", "omega_y_rads", "omega_z_rads")
    return (*FLIGHT_NAMES, *(f"impact_{k + 1}_{part}" for k in range(len(flight.bounces)) for part in parts))


def impact_slice(number: int) -> slice:
    """Where the parameters of impact ``number`` (from 0) are."""
    return slice(N_PARAMETERS + PER_IMPACT * number, N_PARAMETERS + PER_IMPACT * (number + 1))


def parameter_steps(flight: PiecewiseFlight) -> Array:
    """Steps (p,) of the central differences."""
    return np.concatenate([STEPS, *(IMPACT_STEPS for _ in flight.bounces)])


def moved_piecewise(flight: PiecewiseFlight, step: Array) -> PiecewiseFlight:
    """The flight after a parameter step (p,)."""
    bounces = []
    for number, bounce in enumerate(flight.bounces):
        part = step[impact_slice(number)]
        bounces.append(Bounce(bounce.time_s + float(part[0]), bounce.v + part[1:4], bounce.omega + part[4:7], bounce.shift))
    return PiecewiseFlight(moved(flight.first, step[:N_PARAMETERS]), tuple(bounces))


@dataclass(frozen=True)
class _Leg:
    """One segment of m perturbed flights: their states (m, ·) at ``time_s``."""

    start: States
    time_s: float


@dataclass(frozen=True)
class _Lanes:
    """m perturbed flights side by side: ``steps`` (m, p) and their ``inertia`` and its inverse (m, 3, 3)."""

    steps: Array
    inertia: Array
    inverse: Array
    gravity: Array

    def take(self, rows: NDArray[np.int64]) -> "_Lanes":
        return _Lanes(self.steps[rows], self.inertia[rows], self.inverse[rows], self.gravity)


def _lanes(flight: PiecewiseFlight, steps: Array) -> _Lanes:
    inertia = inertia_matrix(flight.first, flight.first.inertia + steps[:, INERTIA])
    return _Lanes(steps, inertia, inverted(inertia), flight.first.gravity_world)


def _flown(leg: _Leg, lanes: _Lanes, times_s: Array) -> States:
    return fall(leg.start, lanes.inverse, times_s, start_time_s=leg.time_s, gravity=lanes.gravity)


def _first_leg(flight: PiecewiseFlight, lanes: _Lanes) -> _Leg:
    at = flight_states(flight.first, lanes.steps[:, :N_PARAMETERS], np.array([flight.first.time_s]))
    return _Leg(_row(at, 0), flight.first.time_s)


def _row(states: States, index: int) -> States:
    return States(states.x[index], states.q[index], states.v[index], states.L[index])


def _struck(before: _Leg, lanes: _Lanes, bounce: Bounce, number: int) -> _Leg:
    """The leg after an impact; flights that are hit at another time are flown back (or on) to the nominal one."""
    part = lanes.steps[:, impact_slice(number)]
    start = States(*(np.empty_like(a) for a in (before.start.x, before.start.q, before.start.v, before.start.L)))
    for shift in np.unique(part[:, 0]):
        rows = np.flatnonzero(part[:, 0] == shift)
        group, time_s = lanes.take(rows), bounce.time_s + float(shift)
        lane = _Leg(_row(before.start, rows), before.time_s)  # type: ignore[arg-type]
        touched = _shifted(_row(_flown(lane, group, np.array([time_s])), 0), bounce.shift)
        L = angular_momentum(touched.q, bounce.omega + part[rows, 4:7], group.inertia)
        after = States(touched.x, touched.q, bounce.v + part[rows, 1:4], L)
        if shift != 0.0:
            after = _row(_flown(_Leg(after, time_s), group, np.array([bounce.time_s])), 0)
        start.x[rows], start.q[rows], start.v[rows], start.L[rows] = after.x, after.q, after.v, after.L
    return _Leg(start, bounce.time_s)


def _shifted(states: States, shift: Array) -> States:
    if not shift.any():
        return states
    turn = np.broadcast_to(quaternion_from_vector(shift[3:]), states.q.shape)
    return States(states.x + shift[:3], quaternion_product(turn, states.q), states.v, states.L)


def _legs(flight: PiecewiseFlight, lanes: _Lanes) -> list[_Leg]:
    legs = [_first_leg(flight, lanes)]
    for number, bounce in enumerate(flight.bounces):
        legs.append(_struck(legs[-1], lanes, bounce, number))
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


def piecewise_poses(flight: PiecewiseFlight, steps: Array, times_s: Array) -> FlightPoses:
    """Poses at ``times_s`` (f,) of the flights reached by the parameter steps (m, p)."""
    reached = piecewise_states(flight, steps, times_s)
    R = rotation_matrices(reached.q)
    com = flight.first.com + steps[:, COM]
    return FlightPoses(centre=reached.x - np.einsum("fmij,mj->fmi", R, com), R=R)


def _perturbations(flight: PiecewiseFlight) -> tuple[NDArray[np.int64], Array]:
    """The parameters that poses depend on, and steps (1 + 2 w, p): none, then each of them forth and back."""
    widths = parameter_steps(flight)
    varied = np.flatnonzero(widths).astype(np.int64)
    steps = np.zeros((1 + 2 * len(varied), flight.size))
    for row, column in enumerate(varied):
        steps[1 + 2 * row, column] = widths[column]
        steps[2 + 2 * row, column] = -widths[column]
    return varied, steps


def piecewise_sensitivity(flight: PiecewiseFlight, times_s: Array) -> tuple[FlightPoses, Array]:
    """Poses (m = 1) and their sensitivity (f, 6, p), as :func:`estimator.motion.flight.poses_and_sensitivity`; ``times_s`` (f,)."""
    varied, steps = _perturbations(flight)
    every = piecewise_poses(flight, steps, times_s)
    sensitivity = np.zeros((len(times_s), 6, flight.size))
    sensitivity[:, :, varied] = pose_differences(every, 2.0 * parameter_steps(flight)[varied])
    return FlightPoses(centre=every.centre[:, :1], R=every.R[:, :1]), sensitivity


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
    legs, bounce = _legs(flight, lanes), flight.bounces[number]
    m = len(steps)
    x, R, before = np.empty((m, 3)), np.empty((m, 3, 3)), np.empty((m, 6))
    shifts = steps[:, impact_slice(number)][:, 0]
    for shift in np.unique(shifts):
        rows = np.flatnonzero(shifts == shift)
        group = lanes.take(rows)
        lane = _Leg(_row(legs[number].start, rows), legs[number].time_s)  # type: ignore[arg-type]
        at = _row(_flown(lane, group, np.array([bounce.time_s + float(shift)])), 0)
        x[rows], R[rows] = at.x, rotation_matrices(at.q)
        before[rows] = np.hstack([at.v, angular_velocity(at.q, at.L, group.inverse)])
    part = steps[:, impact_slice(number)]
    return Touch(x, R, before, np.concatenate([bounce.v, bounce.omega]) + part[:, 1:7])


def touch_and_sensitivity(flight: PiecewiseFlight, number: int) -> tuple[Touch, Array]:
    """Impact ``number`` (m = 1) and the sensitivity (18, p) of position, left rotation vector, velocities before and after it."""
    varied, steps = _perturbations(flight)
    every = _touches(flight, steps, number)
    widths = 2.0 * parameter_steps(flight)[varied]
    result = np.zeros((18, flight.size))
    result[:6, varied] = pose_differences(FlightPoses(every.x[None], every.R[None]), widths)[0]
    for part, values in ((slice(6, 12), every.before), (slice(12, 18), every.after)):
        result[part, varied] = ((values[1::2] - values[2::2]) / widths[:, None]).T
    return Touch(every.x[:1], every.R[:1], every.before[:1], every.after[:1]), result


def piecewise_velocities(flight: PiecewiseFlight, steps: Array, times_s: Array) -> Array:
    """Velocity and angular velocity (f, m, 6), world frame; ``steps`` (m, p), ``times_s`` (f,)."""
    reached = piecewise_states(flight, steps, times_s)
    inverse = _lanes(flight, steps).inverse
    omega = np.stack([angular_velocity(q, L, inverse) for q, L in zip(reached.q, reached.L, strict=True)])
    return np.concatenate([reached.v, omega], axis=2)


def piecewise_velocity_sensitivity(flight: PiecewiseFlight, time_s: float) -> Array:
    """Derivative (6, p) of (v, omega) at one time by the parameters."""
    varied, steps = _perturbations(flight)
    values = piecewise_velocities(flight, steps, np.array([time_s]))[0]
    result = np.zeros((6, flight.size))
    result[:, varied] = ((values[1::2] - values[2::2]) / (2.0 * parameter_steps(flight)[varied])[:, None]).T
    return result
