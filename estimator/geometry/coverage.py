"""Exact area coverage: what share of every pixel a polygon covers.

By Green's theorem an edge that lies inside one pixel adds its height times the area to its right; a running sum along the
row does the rest. No sampling, so the smallest shift of the outline shows.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Points = Float[NDArray[np.float64], "n 2"]
Picture = Float[NDArray[np.float32], "height width"]


def coverage(points: Points, shape: tuple[int, int]) -> Picture:
    """Share of each pixel that the closed polygon ``points`` (px; positive orientation) covers; ``shape`` (height, width).

    Parts of the polygon outside of the picture are moved on to its edge. The polygon must not cross itself.
    """
    height, width = shape
    corners = np.clip(points + 0.5, 0.0, [width, height])
    start, end = _cut_at_pixels(corners)
    middle = 0.5 * (start + end)
    column = np.minimum(middle[:, 0].astype(np.intp), width - 1)
    row = np.minimum(middle[:, 1].astype(np.intp), height - 1)
    rise = end[:, 1] - start[:, 1]
    right = rise * (1.0 - (middle[:, 0] - column))
    cell = row * (width + 1) + column
    total = np.bincount(cell, right, height * (width + 1)) + np.bincount(cell + 1, rise - right, height * (width + 1))
    summed = np.cumsum(total.reshape(height, width + 1), axis=1)[:, :width]
    return -summed.astype(np.float32) if summed.sum() < 0 else summed.astype(np.float32)


def _cut_at_pixels(corners: Points) -> tuple[Points, Points]:
    """The polygon's edges cut wherever they cross a pixel border: starts and ends of the pieces."""
    start, end = corners, np.roll(corners, -1, axis=0)
    for axis in (0, 1):
        start, end = _cut_along(start, end, axis)
    return start, end


def _cut_along(start: Points, end: Points, axis: int) -> tuple[Points, Points]:
    """Cut segments where coordinate ``axis`` is whole."""
    low = np.minimum(start[:, axis], end[:, axis])
    high = np.maximum(start[:, axis], end[:, axis])
    first = np.floor(low) + 1
    cuts = np.maximum(np.ceil(high) - first, 0).astype(np.intp)
    pieces = cuts + 1
    owner = np.repeat(np.arange(len(start)), pieces)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    share = _share_at(start, end, axis, (first, cuts, owner, number))
    follows = np.where(number == cuts[owner], 1.0, np.roll(share, -1))
    step = (end - start)[owner]
    return start[owner] + share[:, None] * step, start[owner] + follows[:, None] * step


def _share_at(
    start: Points, end: Points, axis: int, pieces: tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]
) -> Float[NDArray[np.float64], " piece"]:
    """Where along its segment (0 to 1) each piece begins."""
    first, cuts, owner, number = pieces
    run = end[owner, axis] - start[owner, axis]
    rising = run > 0
    line = np.where(rising, first[owner] + number - 1, first[owner] + cuts[owner] - number)
    share = (line - start[owner, axis]) / np.where(run == 0, 1.0, run)
    return np.where(number == 0, 0.0, np.clip(share, 0.0, 1.0))
