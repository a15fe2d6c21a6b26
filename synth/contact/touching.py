"""When a flying body first touches the plate: the root of the height of its lowest vertex above the plane.

The height is sampled every ten microseconds while the body is near, and its first change of sign found to rounding. A dip of
``w² r / 8 dt²`` (less than 0.1 µm at 1000 rad/s) between two samples would be missed.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from datasets.vocabulary.plate import Plate
from datasets.vocabulary.state import Motion
from synth.effects.links import FlyingBody

Array = NDArray[np.float64]

SAMPLE_S = 1e-5
AT_ONCE = 500
"""Samples whose vertices are turned together."""
LATE = 4
"""Samples within which a body that has parted by no more than a rounding error is clear of the plate."""


class Flight(Protocol):
    """A motion known at every instant."""

    def at(self, times_s: Array) -> Motion:
        """The motion at ``times_s`` (s)."""
        ...


def places_of(body: FlyingBody) -> Array:
    """The vertices (v, 3) m in the body frame."""
    return np.asarray((body.vertices - body.body.com_particle) @ body.body.R_particle_body)


def first_touch(flight: Flight, body: FlyingBody, plate: Plate, *, from_s: float, to_s: float) -> float | None:
    """The first time (s) at which a vertex of ``body`` comes down on ``plate``; ``None`` where none does.

    ``flight`` and ``plate`` count time alike, and ``flight`` is known from ``from_s`` to ``to_s``.
    """
    places = places_of(body)
    corners = places[ConvexHull(places).vertices]
    reach = float(np.linalg.norm(corners, axis=1).max())
    times = np.append(np.arange(from_s, to_s, SAMPLE_S), to_s)
    motion = flight.at(times)
    near = np.flatnonzero(_centre_heights(motion, plate) <= reach)
    heights = np.full(len(times), np.inf)
    for part in np.array_split(near, max(1, len(near) // AT_ONCE)) if len(near) else ():
        heights[part] = lowest(flight.at(times[part]), corners, plate)
    above = np.flatnonzero(heights > 0)
    if len(above) == 0 or above[0] > LATE:
        return from_s
    below = np.flatnonzero(heights[above[0] :] <= 0)
    if len(below) == 0:
        return None
    k = int(above[0] + below[0])
    return float(brentq(lambda t: float(lowest(flight.at(np.array([t])), corners, plate)[0]), times[k - 1], times[k], xtol=1e-16))


def lowest(motion: Motion, places: Array, plate: Plate) -> Array:
    """Height (n,) m of the lowest of ``places`` (v, 3) m, body frame, above the plane at each time of ``motion``."""
    down = Rotation.from_quat(motion.q_world_body).inv().apply(plate.normal_world)
    return np.asarray(_centre_heights(motion, plate) + (places @ down.T).min(axis=0))


def _centre_heights(motion: Motion, plate: Plate) -> Array:
    fixed = (motion.x_world - plate.point_world) @ plate.normal_world
    return np.asarray(fixed - motion.times_s * float(plate.velocity_world @ plate.normal_world))
