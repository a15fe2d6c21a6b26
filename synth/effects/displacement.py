"""Moving an outline along its own normals.

The parallel curve is that of mathematical morphology: the boundary of all points within a distance of the silhouette, or of the silhouette
without all points within a distance of its outside; loops that would form are cut off. A displacement that differs from point to point
moves equally spaced points along their normals; where the result crosses itself, its outer boundary counts.
"""

from collections.abc import Callable
from typing import cast

import numpy as np
import shapely
from numpy.typing import NDArray

from datasets.vocabulary.outline import oriented
from synth.silhouette.noisy_outline import samples_with_normals

Array = NDArray[np.float64]

ROUNDING = 32
"""Segments per quarter circle of a parallel curve; an error below 3e-4 of the distance."""
STEP_PX = 0.5
"""Distance of the points that are displaced one by one; normals are those of chords of twice that length."""


def parallel_curve(outline_px: Array, distance_px: float) -> Array:
    """The curve at ``distance_px`` outside the outline (inside where negative); the largest where it falls apart.

    Raises
    ------
    ValueError
        Where nothing is left.
    """
    return _largest_ring(shapely.buffer(shapely.Polygon(outline_px), distance_px, quad_segs=ROUNDING))


def displaced(outline_px: Array, delta_px: Callable[[Array, Array], Array]) -> Array:
    """The outline with its points moved outwards by ``delta_px(points, normals)`` (n,) px."""
    points, normals = samples_with_normals(outline_px, spacing_px=STEP_PX, phase=0.0)
    moved = points + normals * delta_px(points, normals)[:, None]
    return _largest_ring(shapely.make_valid(shapely.Polygon(moved)))


def _largest_ring(region: shapely.Geometry) -> Array:
    parts = [part for part in shapely.get_parts(region) if isinstance(part, shapely.Polygon) and not part.is_empty]
    if not parts:
        raise ValueError("nothing is left of the outline: the displacement exceeds its width")
    largest = max(parts, key=lambda part: float(part.area))
    return oriented(cast(Array, shapely.get_coordinates(largest.exterior)[:-1]))
