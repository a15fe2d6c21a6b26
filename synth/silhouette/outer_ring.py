"""The outer boundary of what a body's front faces cover in the picture.

Contour edges that run along their front faces form closed loops, the boundary of all front faces together. Projected, they wind as often
round a point of the picture as front faces cover it, so that the silhouette is their union under the non-zero rule [Vatti 1992, by
Clipper2]. At a vertex where several loops meet any edge that leaves may follow any that arrives: winding numbers are the same.
"""

from itertools import pairwise

import manifold3d
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.outline import signed_area
from synth.contour_kernels import loops

Array = NDArray[np.float64]

STEPS = 2.0**44
"""Of the grid on which loops are united, along their longer side: coordinates are rounded to 1e-13 of the extent."""
UNIT = 1e-8
"""To which ``manifold3d`` rounds coordinates of cross-sections."""


def outer_ring(projected: Float[NDArray[np.float64], "v 2"], edges: NDArray[np.int64]) -> Float[NDArray[np.float64], "n 2"]:
    """The outer ring (any unit) of what ``edges`` (s, 2), from the first to the second of ``projected``, wind round; of the largest part.

    The ring has the edges' direction; its last side, which closes it, lies on the first edge with an end on it. Of no edges it is empty.
    As many edges must end at a vertex as begin there.
    """
    if not len(edges):
        return np.zeros((0, 2))
    sides = projected[edges]
    origin = sides[0, 0]
    power = np.exp2(np.floor(np.log2(STEPS / np.ptp(sides[:, 0], axis=0).max())))
    grid = np.rint((sides - origin) * power)
    order, begins = loops(edges)
    corners = grid[order, 0] * UNIT
    section = manifold3d.CrossSection([corners[a:b] for a, b in pairwise(begins.tolist())], manifold3d.FillRule.NonZero)
    ring = np.rint(max(section.to_polygons(), key=signed_area)[::-1] / UNIT)
    place = {point: k for k, point in enumerate(map(tuple, ring.tolist()))}
    ends_first = map(tuple, grid[:, ::-1].reshape(-1, 2))
    first = next((place[point] + k % 2 for k, point in enumerate(ends_first) if point in place), 0)
    return np.roll(ring, -first, axis=0) / power + origin
