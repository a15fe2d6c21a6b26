"""How alike residuals are from frame to frame, at the same place of the outline.

A facet that lets light through stays in view for as many frames as it takes to turn away, and draws the outline in all that time. Samples
of such frames count as fewer than they are, as neighbours along one outline do [Geyer, Statistical Science 7 (1992) 473].
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

SECTORS = 24
"""Of an outline, 15 degrees each: their means hold what turns and shifts a body, which turns by a few degrees
from frame to frame; by judgement."""


def alike_in_time(
    gap_px: Float[NDArray[np.float64], " m"],
    outlines_px: Sequence[Float[NDArray[np.float64], "s 2"]],
    camera: Int[NDArray[np.int64], " f"],
) -> float:
    """One and twice the sum of the correlations of the sectors' mean residuals over frames, up to the first lag that has none.

    ``gap_px`` of the samples of all outlines, in the order of ``outlines_px``, which ``camera`` took one after another;
    frames left out count as none between others.
    """
    means, start = np.zeros((len(outlines_px), SECTORS)), 0
    for row, outline in zip(means, outlines_px, strict=True):
        x, y = (outline - outline.mean(axis=0)).T
        sector = np.floor((np.arctan2(y, x) / (2.0 * np.pi) % 1.0) * SECTORS).astype(np.int64) % SECTORS
        count = np.bincount(sector, minlength=SECTORS)
        row[:] = np.bincount(sector, gap_px[start : start + len(outline)], SECTORS) / np.maximum(count, 1)
        start += len(outline)
    parts = [means[camera == number] for number in np.unique(camera)]
    square, total = float(np.sum(means**2)), 1.0
    for lag in range(1, len(means) // 2):
        rho = sum(float(np.sum(part[lag:] * part[:-lag])) for part in parts) / square
        if rho <= 0.0:
            break
        total += 2.0 * rho
    return total
