"""Closed curves as the points of a polygon, and the directions of their normals."""

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


def unit_circle(count: int) -> Float[NDArray[np.float64], "count 2"]:
    """Unit vectors in equal steps, from the first axis on towards the second."""
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angle), np.sin(angle)])


def largest_part(geometry: shapely.Geometry) -> shapely.Polygon:
    """The polygon of the greatest area among the parts of a geometry."""
    return max(shapely.get_parts(geometry), key=shapely.area)
