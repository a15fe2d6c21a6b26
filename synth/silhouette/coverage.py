"""Pictures of silhouettes on a fine grid, exact in the area of each cell, and the curve on which such a picture has a given level.

Every edge of an outline is cut at the lines of the grid. A piece within one cell covers, of all cells to its right, the share that is its
height; of its own, what lies right of it. Summing along rows gives the area of each cell that the outline encloses, exactly [the method of
FreeType's smooth rasteriser]. Summing over many outlines before is averaging pictures.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from skimage.measure import find_contours

from datasets.vocabulary.outline import oriented, signed_area

Array = NDArray[np.float64]
CERTAIN = 1e-9
"""What summing leaves of a cell that no outline touches."""


@dataclass(frozen=True)
class Grid:
    """``cells_per_px`` cells per pixel and axis; ``shape`` (rows, columns); ``origin_px`` (2,) is the corner of the first cell."""

    origin_px: Array
    cells_per_px: int
    shape: tuple[int, int]


def grid_around(points_px: Float[NDArray[np.float64], "n 2"], margin_px: float, cells_per_px: int) -> Grid:
    """The grid over all points and ``margin_px`` around them."""
    low = np.floor(points_px.min(axis=0) - margin_px)
    columns, rows = (np.ceil(points_px.max(axis=0) + margin_px - low) * cells_per_px).astype(int).tolist()
    return Grid(low, cells_per_px, (rows, columns))


def mean_coverage(outlines_px: Sequence[Float[NDArray[np.float64], "_ 2"]], grid: Grid) -> Float[NDArray[np.float64], "rows columns"]:
    """The share of each cell that the outlines enclose, averaged over the outlines; they lie within the grid."""
    rows, columns = grid.shape
    pieces = [_pieces((outline - grid.origin_px) * grid.cells_per_px) for outline in outlines_px]
    start, end = np.vstack([piece[0] for piece in pieces]), np.vstack([piece[1] for piece in pieces])
    middle = 0.5 * (start + end)
    column, row = np.floor(middle).astype(np.intp).T
    height, right_of = end[:, 1] - start[:, 1], middle[:, 0] - column
    cell = row * (columns + 1) + column
    cells, shares = np.concatenate([cell, cell + 1]), np.concatenate([height * (1 - right_of), height * right_of])
    deposits = np.bincount(cells, shares, rows * (columns + 1))
    share = np.cumsum(deposits.reshape(rows, columns + 1), axis=1)[:, :columns]
    return np.asarray(-share / len(outlines_px))


def quantile_coverage(outlines_px: Sequence[Array], grid: Grid, level: float) -> Float[NDArray[np.float64], "rows columns"]:
    """A picture whose half level encloses what at least the share ``level`` of the outlines encloses (n, 2) px; they lie within it.

    Of every cell the shares that the outlines cover are put in order and averaged about their ``1 - level`` quantile, as far to both sides
    as there are any: where an outline in that place passes the cell's middle, the average is a half. The mean of all has the same curve
    only where outlines lie apart by more than a cell: of outlines that all lie at one place it is the cell's own ramp, of which another
    level than the half is somewhere else.
    """
    mean = mean_coverage(outlines_px, grid)
    between = np.flatnonzero((mean > CERTAIN) & (mean < 1.0 - CERTAIN))
    middle, reach = 1.0 - level, min(level, 1.0 - level)
    edges = np.linspace(0.0, 1.0, len(outlines_px) + 1)
    weight = np.diff(np.clip(edges, middle - reach, middle + reach)) / (2.0 * reach)
    picture = np.round(mean)
    picture.flat[between] = weight @ np.sort(_each_coverage(outlines_px, grid, between), axis=0)
    return picture


def _each_coverage(outlines_px: Sequence[Array], grid: Grid, cells: NDArray[np.intp]) -> Array:
    """The share of some ``cells`` (m,), ascending numbers along the rows, that each outline encloses (k, m); edges lie in those alone."""
    columns, m = grid.shape[1], len(cells)
    deposits = np.zeros((len(outlines_px), m))
    for outline, deposit in zip(outlines_px, deposits, strict=True):
        start, end = _pieces((outline - grid.origin_px) * grid.cells_per_px)
        middle = 0.5 * (start + end)
        column, row = np.floor(middle).astype(np.intp).T
        height, right_of = end[:, 1] - start[:, 1], middle[:, 0] - column
        cell = row * columns + column
        at = np.searchsorted(cells, np.concatenate([cell, cell + 1]))  # what falls between goes to the next
        inside = (at < m) & (cells[np.minimum(at, m - 1)] // columns == np.concatenate([row, row]))
        shares = np.concatenate([height * (1 - right_of), height * right_of])
        deposit[:] = np.bincount(at[inside], shares[inside], m)
    total = np.cumsum(deposits, axis=1)
    row_of = cells // columns
    before = np.searchsorted(row_of, row_of) - 1
    return np.asarray(np.where(before >= 0, total[:, before], 0.0) - total)


def blurred(coverage: Array, sigma_cells: float) -> Array:
    """A picture blurred with a Gaussian."""
    return np.asarray(cv2.GaussianBlur(coverage, (0, 0), sigma_cells, borderType=cv2.BORDER_REPLICATE), dtype=np.float64)


def level_outline(coverage: Array, grid: Grid, level: float) -> Float[NDArray[np.float64], "n 2"]:
    """The outline (px) on which a picture has ``level``; the one of the largest area.

    Raises
    ------
    ValueError
        Where the picture has no such curve.
    """
    curves = [curve[:-1, ::-1] for curve in find_contours(coverage, level) if np.array_equal(curve[0], curve[-1])]
    if not curves:
        raise ValueError(f"the picture of the particle has no closed curve of level {level:g}")
    largest = max(curves, key=lambda curve: abs(signed_area(curve)))
    return oriented((largest + 0.5) / grid.cells_per_px + grid.origin_px)


def _pieces(ring: Array) -> tuple[Array, Array]:
    """Starts and ends of the pieces into which the lines of the grid (unit cells) cut the edges of a closed ring."""
    step = np.roll(ring, -1, axis=0) - ring
    cuts = [(np.arange(len(ring)), np.zeros(len(ring)))] + [_cuts(ring[:, axis], step[:, axis]) for axis in (0, 1)]
    edge, along = (np.concatenate(part) for part in zip(*cuts, strict=True))
    order = np.lexsort([along, edge])
    points = ring[edge[order]] + along[order, None] * step[edge[order]]
    return points, np.roll(points, -1, axis=0)


def _cuts(start: Array, step: Array) -> tuple[NDArray[np.intp], Array]:
    """Which edges are cut by integers, and at what share of their length."""
    low, high = np.minimum(start, start + step), np.maximum(start, start + step)
    first = np.floor(low) + 1
    count = np.maximum(np.ceil(high) - first, 0).astype(np.intp)
    edge = np.repeat(np.arange(len(start)), count)
    line = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    return edge, (line - start[edge]) / step[edge]
