"""From separately fitted flights to one flight with impacts: which sightings belong to which, and where two flights meet.

The collision frame is where the simulated first segment and the second one are nearest to one another. Depth is the loose direction of one
camera, so nearness is judged across its viewing direction; between frames the relative motion is straight.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.motion.flight import Flight, still
from estimator.motion.piecewise import Bounce, PiecewiseFlight
from estimator.search.flight_starts import at_time

Array = NDArray[np.float64]
MEETING_STEPS = 4
"""Newton's, of the time at which two nearly straight flights are nearest."""
DEPTH_WEIGHT = 0.05
"""Of a distance along the viewing direction against one across it."""
LARGEST_REVERSIBLE_RAD = 0.6
"""Turn across the line of sight within a segment, above which outlines tell its sense (notebook 16)."""


def segment_rows(times_s: Array, impacts_s: Array, *, clear_s: float) -> list[NDArray[np.int64]]:
    """Rows of the sightings in each segment; those nearer to an impact than ``clear_s`` are in none, their side is not known yet.

    ``times_s`` (s,) of the sightings, ``impacts_s`` (k,).
    """
    number = np.searchsorted(impacts_s, times_s)
    clear = np.all(np.abs(times_s[:, None] - impacts_s[None, :]) > clear_s, axis=1)
    return [np.flatnonzero((number == k) & clear).astype(np.int64) for k in range(len(impacts_s) + 1)]


def with_pictures_between(times_s: Array, frame: NDArray[np.int64], impacts_s: Array, least: int) -> Array:
    """Times ``impacts_s`` (k,), the nearest to one another merged until ``least`` pictures lie between any two.

    ``times_s``, ``frame`` (s,): of the sightings; those of several cameras in one frame are one picture.
    """
    while len(impacts_s) > 1:
        between = segment_rows(times_s, impacts_s, clear_s=0.0)[1:-1]
        if min(len(np.unique(frame[rows])) for rows in between) >= least:
            break
        impacts_s = nearest_as_one(impacts_s)
    return impacts_s


def nearest_as_one(impacts_s: Array) -> Array:
    """Times ``impacts_s`` (k,) with the two that are nearest to one another as one (k - 1,), between them."""
    first = int(np.argmin(np.diff(impacts_s)))
    return np.concatenate([impacts_s[:first], [impacts_s[first : first + 2].mean()], impacts_s[first + 2 :]])


def meeting_time(before: Flight, after: Flight, guess_s: float, viewing: Array) -> float:
    """When two flights are nearest, seen along ``viewing`` (3,), unit, world frame."""
    time_s = guess_s
    weight = np.eye(3) - (1.0 - DEPTH_WEIGHT) * np.outer(viewing, viewing)
    for _ in range(MEETING_STEPS):
        a, b = (f.states(still(f), np.array([time_s])) for f in (before, after))
        apart, closing = weight @ (a.x - b.x)[0, 0], weight @ (a.v - b.v)[0, 0]
        time_s -= float(apart @ closing) / max(float(closing @ closing), 1e-12)
    return time_s


def joined(flights: list[Flight], impacts_s: list[float], start_s: float) -> PiecewiseFlight:
    """One flight with impacts from separate ones: the pose is that of the first, velocities after an impact are those of the next.

    ``start_s`` becomes the reference time of the first.
    """
    bounces = []
    for flight, time_s in zip(flights[1:], impacts_s, strict=True):
        there = at_time(flight, time_s)
        bounces.append(Bounce(time_s, there.v, there.omega))
    return PiecewiseFlight(at_time(flights[0], start_s), tuple(bounces))


def reversed_turns(flight: PiecewiseFlight, ends_s: tuple[float, float], viewing: Array) -> list[PiecewiseFlight]:
    """The flight with the turn of one segment reversed across the line of sight ``viewing`` (3,), unit, for each segment that turns little.

    A body seen from afar shows how far it turns about an axis across the line of sight, and only by perspective and by what comes into
    sight at its rim which way (the reversal of depth [Koenderink and van Doorn 1991]). Where its pose is known from the flight on the
    other side of an impact, both senses start from that pose and both may be minima. ``ends_s``: first and last time of the sightings (s).
    """
    found = []
    edges = [ends_s[0], *flight.times_s.tolist(), ends_s[1]]
    spins = [at_time(flight.first, edges[1]).omega, *(bounce.omega for bounce in flight.bounces)]
    for number, omega in enumerate(spins):
        along = viewing * float(viewing @ omega)
        if float(np.linalg.norm(omega - along)) * (edges[number + 1] - edges[number]) > LARGEST_REVERSIBLE_RAD:
            continue
        other = 2.0 * along - omega
        if number == 0:
            first = replace(at_time(flight.first, edges[1]), omega=other)
            found.append(replace(flight, first=at_time(first, flight.first.time_s)))
        else:
            bounces = [replace(b, omega=other) if k == number - 1 else b for k, b in enumerate(flight.bounces)]
            found.append(replace(flight, bounces=tuple(bounces)))
    return found
