"""Outlines given as polygons become samples a pixel apart.

What smooths outlines, measures their noise and predicts their bias takes them for even samples, as a camera gives them. The corners of a
polygon among even samples, or corners alone, are neither: smoothing weighs each point alike, so it leans to where points are dense. An
outline that is not evenly sampled, about a pixel apart, is therefore sampled anew along its length, at :data:`SPACING_PX`; one that is stays as it is.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.geometry.closed_curves import resampled

SPACING_PX = 1.0
UNEVEN, FEW = 0.5, 0.02
"""Steps that differ from the median by more than this share of it are uneven; more than a few (share of all) make the outline so.

Boundary noise of 0.2 px on samples a pixel apart changes 1 step in 1000 by as much."""


def evenly_sampled(points_px: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], "m 2"]:
    """A closed outline (px) in even samples."""
    steps = np.linalg.norm(np.roll(points_px, -1, axis=0) - points_px, axis=1)
    typical = float(np.median(steps))
    uneven = np.abs(steps - typical) > UNEVEN * typical
    as_a_camera = 0.5 * SPACING_PX <= typical <= 1.5 * SPACING_PX and uneven.mean() <= FEW
    return points_px if as_a_camera else resampled(points_px, SPACING_PX, fewest=3)
