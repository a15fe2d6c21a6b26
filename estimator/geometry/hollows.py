"""How much of their convex hulls outlines leave empty, and how much of that is the body's and not their noise's."""

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from estimator.geometry.closed_curves import resampled
from estimator.geometry.tangent_hull import MINIMUM_POINTS, normals, smoothed, tangent_hull

Array = NDArray[np.float64]
LEAST_CORNERS = 3
"""Below which an outline has no area."""


def hollow_share(polygons: Sequence[Array]) -> float:
    """Mean share of their convex hulls that outlines ``polygons`` (v, 2) leave empty; those of fewer than three corners do not count."""
    whole = [polygon for polygon in polygons if len(polygon) >= LEAST_CORNERS]
    if not whole:
        return 0.0
    filled = shapely.polygons([shapely.linearrings(polygon) for polygon in whole])
    return float(1.0 - np.mean(shapely.area(filled) / np.maximum(shapely.area(shapely.convex_hull(filled)), 1e-9)))


def hollow_beyond_noise(outlines: Sequence[Array]) -> float:
    """Share that the body leaves empty: that of the smoothed outlines (v, 2) px less that of convex ones of their size with their noise.

    Noise alone leaves 0.01 of a disk 60 px wide seen with 0.2 px, 0.04 with 0.5 px.
    """
    rng = np.random.default_rng(0)
    seen, convex = [], []
    for points in outlines:
        hull = tangent_hull(points)
        if hull.samples >= MINIMUM_POINTS:
            seen.append(smoothed(points))
            convex.append(_convex_like(seen[-1], hull.noise_px, rng))
    return hollow_share(seen) - hollow_share(convex)


def _convex_like(smooth: Array, noise_px: float, rng: np.random.Generator) -> Array:
    """The convex hull of an outline (n, 2) px, drawn with as many samples and with noise, and smoothed."""
    corners = smooth[ConvexHull(smooth).vertices]
    length = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).sum())
    even = resampled(corners, length / len(smooth), fewest=MINIMUM_POINTS)
    return smoothed(even + normals(even) * noise_px * rng.standard_normal((len(even), 1)))
