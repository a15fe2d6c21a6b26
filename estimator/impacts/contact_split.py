"""An impact that was two contacts, taken apart: two times, and the velocities between them.

With the pictures near it left out, the flights before and after an impact, each fitted by itself, are right whatever happened between. Of
two contacts at t1 and t2 the velocities between follow from where those flights are then,

    v = (x_after(t2) - x_before(t1)) / (t2 - t1) - g (t2 - t1) / 2,   omega = log(R_after(t2) R_before(t1)ᵀ) / (t2 - t1),

so a search over both times for the best agreement with the pictures near the impact starts the joint fit. One picture between the
contacts is enough: its pose and the poses at both ends are twelve equations for eight unknowns. Without any there is nothing to take apart.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import errors_of
from estimator.data.fit_task import FitTask, restricted
from estimator.fitting.trajectory import fit
from estimator.motion.flight import Flight, flown
from estimator.motion.piecewise import Bounce, PiecewiseFlight
from estimator.motion.rigid_body import rotation_matrices
from estimator.motion.rotation import rotation_vector
from estimator.search.flight_starts import at_time

Array = NDArray[np.float64]
NEAR_FRAMES = 2.5
"""Pictures this near to an impact are left out to find the flights before and after it."""
LEAST_LEFT = 3
"""Pictures in each of these flights."""
SEARCHED_FRAMES, SEARCH_STEP = 5.0, 0.25
"""Frames to either side of an impact in which two contacts are looked for, and the step. By judgement."""
MOST_STARTS = 4
"""Pairs of contacts that are fitted, those that cost least. By judgement."""
LEAST_GAIN = 0.5
"""Fall of the cost per pair of a picture, 0.5 where noise alone is left, that two contacts with pictures between have to bring."""
MEETING_STEPS = 4
"""Newton's, of the time at which two nearly straight flights are nearest."""


@dataclass(frozen=True)
class Parted:
    """The flights ``before`` and ``after`` impact ``number``, each from its own pictures away from it."""

    number: int
    before: Flight
    after: Flight


def parted(task: FitTask, flight: PiecewiseFlight, number: int, frame_s: float) -> Parted | None:
    """The flights on both sides of an impact; ``None`` where one has too few pictures."""
    times, at = task.sightings.times_s, float(flight.times_s[number])
    away = np.abs(times - at) > NEAR_FRAMES * frame_s
    ends = [-np.inf, *flight.times_s.tolist(), np.inf]
    sides = [np.flatnonzero((times > ends[k]) & (times < ends[k + 1]) & away) for k in (number, number + 1)]
    if min(len(np.unique(task.sightings.frame[side])) for side in sides) < LEAST_LEFT:
        return None
    legs = [_leg(flight, k, float(np.median(times[side]))) for k, side in zip((number - 1, number), sides, strict=True)]
    before, after = (fit(restricted(task, side), leg).state for side, leg in zip(sides, legs, strict=True))
    return Parted(number, before, after)


def _leg(flight: PiecewiseFlight, number: int, time_s: float) -> Flight:
    """The free flight after impact ``number`` (-1: the first one), with ``time_s`` as its reference time."""
    return at_time(replace(flight, bounces=flight.bounces[: number + 1]), time_s)


def shift_between(a: Flight, b: Flight) -> Array:
    """The pose (6,) of ``b`` against ``a`` at the reference time of both: m, left rotation vector."""
    turn = rotation_matrices(b.q[None])[0] @ rotation_matrices(a.q[None])[0].T
    return np.concatenate([b.x - a.x, rotation_vector(turn[None])[0]])


def apart(flight: PiecewiseFlight, sides: Parted) -> PiecewiseFlight:
    """``flight`` with the two sides of an impact as they are, and the impact when they are nearest to one another."""
    time_s = float(flight.times_s[sides.number])
    for _ in range(MEETING_STEPS):
        a, b = at_time(sides.before, time_s), at_time(sides.after, time_s)
        rate = np.concatenate([b.v - a.v, b.omega - a.omega])
        unit = np.repeat([np.linalg.norm(rate[:3]), np.linalg.norm(rate[3:])], 3)
        time_s -= float((shift_between(a, b) / unit) @ (rate / unit)) / 2.0
    a, b = at_time(sides.before, time_s), at_time(sides.after, time_s)
    return _with(flight, sides, (Bounce(time_s, b.v, b.omega, shift_between(a, b)),))


def _with(flight: PiecewiseFlight, sides: Parted, bounces: tuple[Bounce, ...]) -> PiecewiseFlight:
    first = at_time(sides.before, flight.first.time_s) if sides.number == 0 else flight.first
    return PiecewiseFlight(first, (*flight.bounces[: sides.number], *bounces, *flight.bounces[sides.number + 1 :]))


def split_starts(task: FitTask, flight: PiecewiseFlight, sides: Parted, frame_s: float) -> list[PiecewiseFlight]:
    """``flight`` with the impact as two, as starts for the joint fit, the best first; none where pictures show no time between.

    A time of impact does not move past a picture in a fit, so each start has other pictures between the contacts.
    """
    times = _times(flight, sides.number, frame_s)
    near = restricted(task, np.flatnonzero(np.abs(task.sightings.times_s - flight.times_s[sides.number]) <= SEARCHED_FRAMES * frame_s))
    if len(near.sightings) == 0 or len(times) == 0:
        return []
    came, left = ([at_time(side, t) for t in times] for side in (sides.before, sides.after))
    costs = [_cost(near, side) for side in (sides.before, sides.after)]
    seen, pairs = near.sightings.times_s, np.count_nonzero(near.weight) / len(near.sightings)
    together = min(float(costs[0][seen < t].sum() + costs[1][seen >= t].sum()) for t in times)
    best: dict[tuple[int, int], tuple[float, Flight, Flight]] = {}
    for i, first in enumerate(times):
        for k in range(i + 1, len(times)):
            rows = np.flatnonzero((seen > first) & (seen < times[k]))
            if len(rows) == 0:
                continue
            leg = _between(came[i], left[k])
            cost = float(costs[0][seen <= first].sum() + costs[1][seen >= times[k]].sum() + _cost(restricted(near, rows), leg).sum())
            key = (int(rows.min()), int(rows.max()))
            if cost < best.get(key, (together - LEAST_GAIN * pairs, leg, leg))[0]:
                best[key] = (cost, leg, left[k])
    taken = sorted(best.values(), key=lambda each: each[0])[:MOST_STARTS]
    return [_with(flight, sides, tuple(Bounce(leg.time_s, leg.v, leg.omega) for leg in (a, b))) for _, a, b in taken]


def _times(flight: PiecewiseFlight, number: int, frame_s: float) -> list[float]:
    at = flight.times_s[number] + frame_s * np.arange(-SEARCHED_FRAMES, SEARCHED_FRAMES + SEARCH_STEP, SEARCH_STEP)
    ends = [flight.first.time_s, *flight.times_s.tolist(), np.inf]
    return [float(t) for t in at[(at > ends[number]) & (at < ends[number + 2])]]


def _between(came: Flight, left: Flight) -> Flight:
    """The flight that goes from the pose of ``came`` to that of ``left``, from the time of the one to the time of the other."""
    gone, shift = left.time_s - came.time_s, shift_between(came, left)
    v, omega = shift[:3] / gone - 0.5 * came.gravity_world * gone, shift[3:] / gone
    return replace(came, v=v, omega=omega)


def _cost(near: FitTask, leg: Flight) -> Array:
    """Cost (n,) of each sighting under one flight."""
    errors = errors_of(near, leg, flown(leg, near.sightings.times_s))
    return np.asarray(errors.cost).reshape(len(near.sightings), -1).sum(axis=1)
