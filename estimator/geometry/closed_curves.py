"""Closed curves as the points of a polygon, and the directions of their normals."""

from collections.abc import Sequence
from functools import cache

import numba
import numpy as np
import shapely
from jaxtyping import Float
from numpy.typing import NDArray


def resampled(points: Float[NDArray[np.float64], "n 2"], spacing: float, *, fewest: int) -> Float[NDArray[np.float64], "m 2"]:
    """The closed polygon sampled at equal arc lengths of about ``spacing``, in ``fewest`` points at least; the first point stays."""
    closed = np.vstack([points, points[:1]])
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    number = max(round(float(arc[-1]) / spacing), fewest)
    at = np.arange(number) * (arc[-1] / number)
    return np.column_stack([np.interp(at, arc, closed[:, axis]) for axis in range(2)])


def through(points: Float[NDArray[np.float64], "n 2"], halvings: int) -> Float[NDArray[np.float64], "m 2"]:
    """A smooth closed curve through points, as a polygon of ``2**halvings`` as many [Dyn, Levin and Gregory, CAGD 4 (1987) 257]."""
    for _ in range(halvings):
        between = (9.0 * (points + np.roll(points, -1, axis=0)) - np.roll(points, 1, axis=0) - np.roll(points, -2, axis=0)) / 16.0
        points = np.stack([points, between], axis=1).reshape(-1, 2)
    return points


@cache
def unit_circle(count: int) -> Float[NDArray[np.float64], "count 2"]:
    """Unit vectors in equal steps, from the first axis on towards the second; made once, so they cannot be written to."""
    angle = 2.0 * np.pi * np.arange(count) / count
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    circle.setflags(write=False)
    return circle


def area(points: Float[NDArray[np.float64], "n 2"]) -> float:
    """Of a closed polygon; negative where it is counted from the second axis towards the first."""
    x, y = points.T
    return 0.5 * float(x[:-1] @ y[1:] - x[1:] @ y[:-1] + x[-1] * y[0] - x[0] * y[-1])


def largest_ring(rings: Sequence[Float[NDArray[np.float64], "n 2"]]) -> Float[NDArray[np.float64], "n 2"]:
    """The closed polygon of the greatest area: where an outline falls apart, that is what is seen."""
    return np.asarray(max(rings, key=area) if len(rings) > 1 else rings[0], dtype=np.float64)


def largest_part(geometry: shapely.Geometry) -> shapely.Polygon:
    """The polygon of the greatest area among the parts of a geometry."""
    return max(shapely.get_parts(geometry), key=shapely.area)


@numba.njit(cache=True)
def nearest(curve, points, size):  # type: ignore[no-untyped-def]
    """Which (s,) of the points of a ``curve`` (n, 2) is nearest to each of ``points`` (s, 2), by square buckets of some ``size``.

    Any size finds the same, and a tree takes longer to build and to ask. Points are numbers, or the search would never end.
    """
    low_x, low_y = curve[:, 0].min(), curve[:, 1].min()
    wide, high = int((curve[:, 0].max() - low_x) / size) + 1, int((curve[:, 1].max() - low_y) / size) + 1
    head, following = np.full((high, wide), -1, np.int64), np.empty(len(curve), np.int64)
    for i in range(len(curve) - 1, -1, -1):
        y, x = int((curve[i, 1] - low_y) / size), int((curve[i, 0] - low_x) / size)
        following[i], head[y, x] = head[y, x], i
    found = np.empty(len(points), np.int64)
    for k in range(len(points)):
        x0, y0 = int(np.floor((points[k, 0] - low_x) / size)), int(np.floor((points[k, 1] - low_y) / size))
        best, at, ring = np.inf, -1, max(0, -x0, -y0, x0 - wide + 1, y0 - high + 1)
        while at < 0 or (max(ring - 1, 0) * size) ** 2 <= best:
            for y in range(max(y0 - ring, 0), min(y0 + ring, high - 1) + 1):
                whole = abs(y - y0) == ring
                for x in range(x0 - ring, x0 + ring + 1, 1 if whole or ring == 0 else 2 * ring):
                    i = head[y, x] if 0 <= x < wide else -1
                    while i >= 0:
                        far = (curve[i, 0] - points[k, 0]) ** 2 + (curve[i, 1] - points[k, 1]) ** 2
                        if far < best:
                            best, at = far, i
                        i = following[i]
            ring += 1
        found[k] = at
    return found
