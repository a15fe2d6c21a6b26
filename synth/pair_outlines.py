"""The outlines of two particles in one picture: two where they are apart, one where a segmentation sees a single dark patch.

Two silhouettes nearer than ``NARROWEST_PX`` are one: a gap narrower than a pixel is not seen. The one outline is that of their union, with
such a gap filled (a morphological closing), as pixels fill it.
"""

from typing import cast

import numpy as np
import shapely
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.outline import oriented

Array = NDArray[np.float64]

NARROWEST_PX = 1.0
QUARTER_SEGMENTS = 32
"""Of the closing's arcs."""


def outlines_of_two(first_px: Float[NDArray[np.float64], "n 2"], second_px: Float[NDArray[np.float64], "m 2"]) -> tuple[Array, ...]:
    """The outlines (px, positive area) of two silhouettes that share a picture, the larger one first, or the one of both."""
    polygons = [shapely.make_valid(shapely.Polygon(points)) for points in (first_px, second_px)]
    if shapely.distance(*polygons) > NARROWEST_PX:
        return tuple(sorted((first_px, second_px), key=lambda points: -shapely.area(shapely.Polygon(points))))
    reach = NARROWEST_PX / 2 + 1e-6
    wide = shapely.buffer(shapely.union_all(polygons), reach, quad_segs=QUARTER_SEGMENTS)
    both = shapely.buffer(wide, -reach, quad_segs=QUARTER_SEGMENTS)
    largest = max(shapely.get_parts(both), key=shapely.area)
    return (oriented(cast(Array, shapely.get_coordinates(largest.exterior)[:-1])),)
