"""Closed curves as the points of a polygon, and the directions of their normals."""

from collections.abc import Sequence
from functools import cache

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
