"""Outlines of one recording in one ``.npz`` file.

``points_px`` (n, 2) float64 holds the points of all outlines after each other, ``offsets`` (entries + 1,) int64 where each begins; an
empty outline is two equal offsets.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.array_files import read_arrays, write_arrays
from datasets.errors import InputError
from datasets.vocabulary.outline import Outline, oriented


def write_outlines(path: Path, outlines: Sequence[Outline]) -> None:
    """Write the outlines of one recording."""
    lengths = [len(outline.points_px) for outline in outlines]
    points = np.concatenate([np.zeros((0, 2)), *(outline.points_px for outline in outlines)]).astype(np.float64)
    write_arrays(path, {"points_px": points, "offsets": np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)})


def read_outlines(path: Path, count: int | None = None) -> tuple[Outline, ...]:
    """The outlines of one recording, each turned to positive area; ``count`` of them, where it is known how many there are to be.

    Raises
    ------
    InputError
        Naming the file and the frame, when something does not fit.
    """
    arrays = read_arrays(path, ("points_px", "offsets"))
    points, offsets = arrays["points_px"], arrays["offsets"]
    if points.ndim != 2 or points.shape[1] != 2 or points.dtype.kind not in "fiu":
        raise InputError(f"{path}: expected points_px of shape (n, 2), got {points.dtype} of shape {points.shape}.")
    if offsets.ndim != 1 or offsets.dtype.kind not in "iu" or not _are_offsets(offsets.astype(np.int64), len(points)):
        raise InputError(f"{path}: expected offsets that rise from 0 to {len(points)} (the number of points), got {_ends(offsets)}.")
    if count is not None and len(offsets) - 1 != count:
        raise InputError(f"{path}: expected {count} outlines, one per recorded entry, got {len(offsets) - 1}.")
    pieces = np.split(points.astype(np.float64, copy=False), offsets[1:-1].astype(np.int64))
    return tuple(_outline(path, number, piece) for number, piece in enumerate(pieces if len(offsets) > 1 else []))


def _are_offsets(offsets: NDArray[np.int64], count: int) -> bool:
    return bool(len(offsets) > 0 and offsets[0] == 0 and offsets[-1] == count and np.all(np.diff(offsets) >= 0))


def _ends(offsets: NDArray[np.generic]) -> str:
    return f"{offsets.ravel()[0]} to {offsets.ravel()[-1]}" if offsets.size else "none"


def _outline(path: Path, number: int, points: NDArray[np.float64]) -> Outline:
    if 0 < len(points) < 3:
        raise InputError(f"{path}: frame {number}: expected an outline of at least 3 points or none, got {len(points)}.")
    if not np.all(np.isfinite(points)):
        raise InputError(f"{path}: frame {number}: expected finite pixel coordinates, got NaN or infinity.")
    return Outline(oriented(points))
