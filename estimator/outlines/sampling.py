"""Outlines given as polygons become samples a pixel apart.

What smooths outlines, measures their noise and predicts their bias takes them for even samples, as a camera gives them. Corners of a
polygon among even samples, or corners alone, are neither: smoothing weighs each point alike, so it leans to where points are dense. An
outline that is not evenly sampled is therefore sampled anew along its length, :data:`SPACING_PX` apart; one that is stays as it is.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.geometry.closed_curves import resampled

SPACING_PX = 1.0
"""Of an outline's samples, as those measured in pictures have it."""
CROWDED, SPARSE, FEW = 1.15, 1.7, 0.015
"""Even samples have no two steps in a row that are together shorter than 1.15 of the median step, and none longer than 1.7.

More than 1.5% of such places make an outline uneven. A step across a sharp corner is short alone, and boundary noise of 0.2 px lengthens
steps a pixel long by 4%."""


def evenly_sampled(points_px: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], "m 2"]:
    """A closed outline (px) in even samples."""
    steps = np.linalg.norm(np.roll(points_px, -1, axis=0) - points_px, axis=1)
    typical = float(np.median(steps))
    uneven = (steps + np.roll(steps, -1) < CROWDED * typical) | (steps > SPARSE * typical)
    return points_px if uneven.mean() <= FEW else resampled(points_px, SPACING_PX, fewest=3)
