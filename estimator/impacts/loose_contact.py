"""Impacts that are more than one contact: the particle moves on between them, and leaves with another pose than it came with.

Two contacts a time ``d`` apart at which the velocities jump by ``D1`` and ``D2`` look, from far, like one jump ``D = D1 + D2`` at a time
between, and a shift of the pose by a part of either jump times a part of ``d``. Of its six coordinates one is a shift of the time;
the other five are here ``shift = B z``, z in seconds: ``B`` spans, with ``|D v|`` and ``|D omega|`` over sqrt 3 as units, what is not along
``(D v, D omega)``. A contact of no duration has z = 0; one whose parts are spread over ``s`` has z ~ N(0, s²), as for measured
trajectories (:mod:`estimator.measurements.trajectories.meeting_flights`).

So whether an impact was one contact is a test of z against its covariance (chi-square of 5), and s what z asks for beyond it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import brentq

from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.refinement import NOTHING_SEEN, NothingSeen
from estimator.motion.flight import FlightPoses, pose_differences
from estimator.motion.piecewise import (
    Bounce,
    PiecewiseFlight,
    moved_piecewise,
    piecewise_poses,
    piecewise_sensitivity,
    touch_and_sensitivity,
)

Array = NDArray[np.float64]
COORDINATES = 5
"""Of a shift of the pose that is no shift of the time."""
SHIFT_STEP_S = 1e-7
"""For difference quotients: at the velocities of a drop, shifts of a tenth of a micrometre."""
LONGEST_SPREAD_S = 1.0
"""Of a contact in time, above all that an impact lasts: an end of the search for a root."""


@dataclass(frozen=True)
class LooseContact:
    """Impact ``number`` whose pose may shift by ``basis`` (6, 5) times z (5,) s, z of the standard deviation ``spread_s``."""

    number: int
    basis: Array
    spread_s: float


def loose_contact(flight: PiecewiseFlight, number: int, spread_s: float) -> LooseContact:
    """The shifts that contacts spread over ``spread_s`` give the impact ``number``."""
    touch, _ = touch_and_sensitivity(flight, number)
    jump = touch.after[0] - touch.before[0]
    sizes = np.repeat([np.linalg.norm(jump[:3]), np.linalg.norm(jump[3:])], 3) / np.sqrt(3.0)
    sizes = np.maximum(sizes, 1e-9)
    return LooseContact(number, sizes[:, None] * null_space((jump / sizes)[None]), spread_s)


def spread_of(flight: PiecewiseFlight, contact: LooseContact) -> Array:
    """The shift of an impact of ``flight`` as z (5,) s."""
    return np.asarray(np.linalg.pinv(contact.basis) @ flight.bounces[contact.number].shift)


def moved_loose(flight: PiecewiseFlight, step: Array, loose: tuple[LooseContact, ...]) -> PiecewiseFlight:
    """The flight after a step (p + 5 l,) of its parameters and of the shifts of its loose contacts."""
    moved = moved_piecewise(flight, step[: flight.size])
    bounces = list(moved.bounces)
    for row, contact in enumerate(loose):
        at = flight.size + COORDINATES * row
        bounce = bounces[contact.number]
        bounces[contact.number] = replace(bounce, shift=bounce.shift + contact.basis @ step[at : at + COORDINATES])
    return replace(moved, bounces=tuple(bounces))


def loose_sensitivity(flight: PiecewiseFlight, times_s: Array, loose: tuple[LooseContact, ...]) -> tuple[FlightPoses, Array]:
    """Poses (m = 1) and their sensitivity (f, 6, p + 5 l); ``times_s`` (f,)."""
    at, S = piecewise_sensitivity(flight, times_s)
    parts = [_by_shift(flight, times_s, contact) for contact in loose]
    return at, np.concatenate([S, *parts], axis=2)


def _by_shift(flight: PiecewiseFlight, times_s: Array, contact: LooseContact) -> Array:
    still = np.zeros((1, flight.size))
    ways = [sign * SHIFT_STEP_S * column for column in contact.basis.T for sign in (1.0, -1.0)]
    flights = [flight, *(_with_shift(flight, contact, way) for way in ways)]
    every = [piecewise_poses(f, still, times_s) for f in flights]
    stacked = FlightPoses(np.concatenate([e.centre for e in every], axis=1), np.concatenate([e.R for e in every], axis=1))
    return pose_differences(stacked, np.full(COORDINATES, 2.0 * SHIFT_STEP_S))


def _with_shift(flight: PiecewiseFlight, contact: LooseContact, more: Array) -> PiecewiseFlight:
    bounces = list(flight.bounces)
    bounce: Bounce = bounces[contact.number]
    bounces[contact.number] = replace(bounce, shift=bounce.shift + more)
    return replace(flight, bounces=tuple(bounces))


def spread_equations(flight: PiecewiseFlight, loose: tuple[LooseContact, ...]) -> NormalEquations:
    """Normal equations (p + 5 l) of how far the contacts may be spread."""
    size = flight.size + COORDINATES * len(loose)
    precision, values = np.zeros(size), np.zeros(size)
    for row, contact in enumerate(loose):
        part = slice(flight.size + COORDINATES * row, flight.size + COORDINATES * (row + 1))
        precision[part], values[part] = contact.spread_s**-2, spread_of(flight, contact)
    return NormalEquations(np.diag(precision), precision * values, 0.5 * float(values @ (precision * values)))


def spread_needed(z: Array, covariance: Array) -> float:
    """The spread (s) at which z is as large as expected; 0 where its covariance alone explains it.

    ``z`` (5,) s, ``covariance`` (5, 5).

    Raises
    ------
    NothingSeen
        Where z or its covariance are no numbers.
    """
    if not (np.isfinite(z).all() and np.isfinite(covariance).all()):
        raise NothingSeen(NOTHING_SEEN)

    def excess(spread: float) -> float:
        return float(z @ np.linalg.solve(covariance + spread**2 * np.eye(COORDINATES), z)) - COORDINATES

    if excess(0.0) <= 0.0 or excess(LONGEST_SPREAD_S) >= 0.0:
        return 0.0 if excess(0.0) <= 0.0 else LONGEST_SPREAD_S
    return float(brentq(excess, 0.0, LONGEST_SPREAD_S, xtol=1e-9))
