"""Impacts that are more than one contact: the particle moves on between them, and leaves with another pose than it came with.

Two contacts a time ``d`` apart at which the velocities jump by ``D1`` and ``D2`` look, from far, like one jump ``D = D1 + D2`` at a time
between, and a shift of the pose by a part of either jump times a part of ``d``. Of its six coordinates one is a shift of the time;
the other five are here ``shift = B z``, z in seconds: ``B`` spans, with ``|D v|`` and ``|D omega|`` over sqrt 3 as units, what is not along
``(D v, D omega)``. A contact of no duration has z = 0; one whose parts are spread over ``s`` has z ~ N(0, s²), as for measured
trajectories (:mod:`estimator.measurements.trajectories.meeting_flights`).

So whether an impact was one contact is a test of z against its covariance (chi-square of 5), and s what z asks for beyond it.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import brentq

from estimator.fitting.stable_inverse import NOTHING_SEEN, NothingSeen
from estimator.motion.piecewise import SHIFT, Loose, PiecewiseFlight, named, touch_and_sensitivity

Array = NDArray[np.float64]
COORDINATES = 5
"""Of a shift of the pose that is no shift of the time."""
CONTACT_S = 6e-6
"""Spread of a single contact, whose friction may act at any instant of it: the standard deviation of an instant within 20 µs. In the truth
of 24 made drops contacts last 14 to 29 µs."""
LONGEST_SPREAD_S = 1.0
"""Of a contact in time, above all that an impact lasts: an end of the search for a root, and no prior to speak of."""


def loosened(flight: PiecewiseFlight, number: int, spread_s: float) -> PiecewiseFlight:
    """The flight with a block for the shifts that contacts spread over ``spread_s`` give the impact ``number``."""
    touch, _ = touch_and_sensitivity(flight, number)
    jump = touch.after[0] - touch.before[0]
    sizes = np.repeat([np.linalg.norm(jump[:3]), np.linalg.norm(jump[3:])], 3) / np.sqrt(3.0)
    sizes = np.maximum(sizes, 1e-9)
    return with_loose(flight, number, Loose(sizes[:, None] * null_space((jump / sizes)[None]), spread_s))


def with_lasting_contacts(flight: PiecewiseFlight) -> PiecewiseFlight:
    """The flight with impacts that were held to one pose as loose as a single contact leaves them."""
    for number, bounce in enumerate(flight.bounces):
        if bounce.loose is None:
            flight = loosened(flight, number, CONTACT_S)
    return flight


def with_loose(flight: PiecewiseFlight, number: int, loose: Loose | None) -> PiecewiseFlight:
    """The flight with the impact ``number`` loose, or not."""
    return replace(flight, bounces=tuple(replace(b, loose=loose) if k == number else b for k, b in enumerate(flight.bounces)))


def spread_of(flight: PiecewiseFlight, number: int) -> Array:
    """The shift of a loose impact as z (5,) s."""
    return flight.values[flight.layout[named(SHIFT, number)]]


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

    return spread_without(excess)


def spread_without(excess: Callable[[float], float]) -> float:
    """The spread (s) at which nothing is left of an ``excess`` that falls with it; 0 where there is none without any."""
    if excess(0.0) <= 0.0 or excess(LONGEST_SPREAD_S) >= 0.0:
        return 0.0 if excess(0.0) <= 0.0 else LONGEST_SPREAD_S
    return float(brentq(excess, 0.0, LONGEST_SPREAD_S, xtol=1e-9))
