"""Where two convex bodies are nearest: point, common normal, signed gap.

``gap = max over unit n of (min_a n.a - max_b n.b)``: the distance along the normal of the plane that separates the two best, negative where
they overlap by that much. The faces of the Minkowski difference are its candidates; the difference is built up only where it matters, from
support points in the direction of the face found so far until it holds [expanding polytope: van den Bergen, Game Developers Conference
2001]. The face's corners say which points of the bodies meet.

Valid for bodies about as near as touching, whose centres are on either side of the contact.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

Array = NDArray[np.float64]
FIRST_DIRECTIONS = 64
"""Directions that are tried before faces, about 25° apart."""
MOST_ROUNDS = 60
"""Corners that are added to the difference of two hulls; it ends before as a rule."""
TOLERANCE = 1e-9
"""Of the bodies' size."""
JOGGLED = "QJ"
"""Points that lie in one plane, as those of two parallel faces do, are moved by some rounding errors."""
FACING = 0.1
"""Cosine against the line of centres that a normal has at least."""
GOLDEN_RAD = np.pi * (3.0 - np.sqrt(5.0))
"""Turn between neighbours of an even spiral over the sphere."""


@dataclass(frozen=True)
class Nearest:
    """``normal`` (3,), unit, into the first body; ``gap_m``; ``point`` (3,) m in the middle between the two places that are nearest."""

    normal: Array
    gap_m: float
    point: Array


def nearest(first: Array, second: Array) -> Nearest:
    """The nearest places of the convex hulls of ``first`` (v, 3) m and ``second`` (w, 3) m, one frame."""
    apart = first.mean(axis=0) - second.mean(axis=0)
    size = float(np.linalg.norm(apart))
    pairs = np.array([_support(first, second, -n) for n in _around(apart / size)], dtype=np.int64)
    pairs = np.unique(np.vstack([pairs, [_support(first, second, n) for n in (*np.eye(3), *-np.eye(3))]]), axis=0)
    for _ in range(MOST_ROUNDS):
        hull = ConvexHull((first[pairs[:, 0]] - second[pairs[:, 1]]) / size, qhull_options=JOGGLED)
        face = _separating(hull, apart / size)
        n, offset = hull.equations[face, :3], hull.equations[face, 3]
        a, b = _support(first, second, n)
        further = (first[a] - second[b]) / size
        if further @ n + offset <= TOLERANCE:
            break
        pairs = np.vstack([pairs, [a, b]])
    corners = hull.simplices[face]
    shares = _shares((first[pairs[corners, 0]] - second[pairs[corners, 1]]) / size, -offset * n)
    point = 0.5 * (shares @ first[pairs[corners, 0]] + shares @ second[pairs[corners, 1]])
    return Nearest(-n, float(offset * size), point)


def _around(axis: Array) -> Array:
    """Unit vectors spread over the half of the sphere about ``axis``."""
    k = np.arange(FIRST_DIRECTIONS) + 0.5
    up = 1.0 - k / FIRST_DIRECTIONS
    flat = np.sqrt(1.0 - up**2)
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    along = (flat * np.cos(GOLDEN_RAD * k), flat * np.sin(GOLDEN_RAD * k), up)
    return np.asarray(np.column_stack(along) @ np.array([side, np.cross(axis, side), axis]))


def _support(first: Array, second: Array, direction: Array) -> tuple[int, int]:
    """Which vertices make the difference's farthest point along a direction."""
    return int(np.argmax(first @ direction)), int(np.argmin(second @ direction))


def _separating(hull: ConvexHull, axis: Array) -> int:
    """The face that looks from the first body to the second, beyond which the origin lies farthest, or least deep within."""
    facing = hull.equations[:, :3] @ axis < -FACING
    return int(np.argmax(np.where(facing, hull.equations[:, 3], -np.inf)))


def _shares(corners: Array, target: Array) -> Array:
    """Barycentric coordinates (3,) of the point of a triangle's plane nearest to ``target``, kept within the triangle."""
    edges = (corners[1:] - corners[0]).T
    found, *_ = np.linalg.lstsq(edges, target - corners[0], rcond=None)
    shares = np.clip(np.array([1.0 - found.sum(), *found]), 0.0, 1.0)
    return np.asarray(shares / shares.sum())
