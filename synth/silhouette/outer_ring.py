"""The outer boundary of everything that a set of line segments encloses.

Noding and polygonising all contour segments of a scanned mesh is slow, because most of them lie far inside. Segments that a
coarse picture shows to be near the outside are tried first. Their ring ``P`` lies within the true one ``S``; if every segment
left out lies within ``P``, the boundary of ``S``, which is made of segments, does so too, and ``P = S`` exactly. Otherwise all
segments are taken.
"""

from typing import cast

import cv2
import numpy as np
import shapely
from jaxtyping import Float
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEW_SEGMENTS = 400
"""Below this number sorting out does not pay."""
GRID = 1000
"""Cells of the coarse picture along the longer side."""
MARGIN = 2
"""Cells left free around the segments in the coarse picture, and cells from the outside that still count as near."""
SUBCELL_BITS = 6
CHAIN = 16
"""Segments that are looked at together."""


def outer_ring(segments: Float[NDArray[np.float64], "s 2 2"]) -> Float[NDArray[np.float64], "n 2"]:
    """The outer ring of the regions that ``segments`` (any unit) enclose, exactly; the largest where they fall apart."""
    if len(segments) < FEW_SEGMENTS:
        return _ring(_enclosed(segments))
    near = near_outside(segments)
    region = _enclosed(segments[near])
    if region.is_empty or not _covers(region, segments[~near]):
        region = _enclosed(segments)
    return _ring(region)


def near_outside(segments: Float[NDArray[np.float64], "s 2 2"]) -> NDArray[np.bool_]:
    """Which segments come within about ``MARGIN`` cells of the outside in a coarse picture."""
    low, high = (np.array([extreme(segments[..., axis]) for axis in (0, 1)]) for extreme in (np.min, np.max))
    cell = float((high - low).max()) / GRID
    on_grid = (segments - low) / cell + MARGIN
    columns, rows = (np.ceil((high - low) / cell).astype(int) + 2 * MARGIN + 1).tolist()
    picture = np.zeros((rows, columns), dtype=np.uint8)
    fixed_point = np.rint(on_grid * 2**SUBCELL_BITS).astype(np.int32)
    cv2.polylines(picture, list(fixed_point), False, 1, 1, cv2.LINE_8, SUBCELL_BITS)
    cv2.floodFill(picture, None, (0, 0), 2)
    kernel = np.ones((2 * MARGIN + 1, 2 * MARGIN + 1), dtype=np.uint8)
    outside = cv2.dilate((picture == 2).view(np.uint8), kernel)
    start, end = on_grid[:, 0], on_grid[:, 1]
    cells = np.rint(start + np.linspace(0, 1, 5)[:, None, None] * (end - start)).astype(np.intp)
    return cast(NDArray[np.bool_], outside[cells[..., 1], cells[..., 0]].any(axis=0))


def _covers(region: shapely.Geometry, segments: Array) -> bool:
    """Whether ``region`` covers every segment (s, 2, 2).

    Segments next to each other about the middle are joined to chains of ``CHAIN``, which are fewer: one that is covered covers its
    segments. Of the others, which leave the region between two segments or along one, the segments are looked at.
    """
    shapely.prepare(region)
    x, y = (segments[:, 0] - np.reshape(region.bounds, (2, 2)).mean(axis=0)).T
    chained = len(segments) // CHAIN * CHAIN
    about = segments[np.argsort(np.arctan2(y, x))]
    chains = about[:chained].reshape(-1, 2 * CHAIN, 2)
    open_ones = chains[~shapely.covers(region, shapely.linestrings(chains))]
    rest = np.concatenate([open_ones.reshape(-1, 2, 2), about[chained:]])
    return bool(shapely.covers(region, shapely.linestrings(rest)).all())


def _enclosed(segments: Array) -> shapely.Geometry:
    noded = shapely.node(shapely.multilinestrings(segments))
    regions = shapely.polygonize([noded])
    if regions.is_empty:
        return shapely.Polygon()
    parts = shapely.get_parts(shapely.coverage_union_all([regions]))
    filled = shapely.polygons(shapely.get_exterior_ring(parts))
    return cast(shapely.Geometry, filled[np.argmax(shapely.area(filled))])


def _ring(region: shapely.Geometry) -> Array:
    return cast(Array, shapely.get_coordinates(shapely.get_exterior_ring(region))[:-1])
