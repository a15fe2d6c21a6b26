"""Points of plumb lines that a person clicked: a CSV file with the columns ``camera`` (1, 2, ...), ``line``, ``x_px``, ``y_px``."""

import csv
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.rig_files.matrices import bytes_of

COLUMNS = ("camera", "line", "x_px", "y_px")
FARTHEST_PX = 1e6


def read_plumb_points(path: Path) -> dict[tuple[int, int], NDArray[np.float64]]:
    """Points (n, 2) px by camera (counted from 0) and line.

    Raises
    ------
    InputError
        Naming the file, the line, what was expected and what came.
    """
    try:
        rows = list(csv.reader(bytes_of(path).decode("utf-8").splitlines()))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: expected a CSV file, got another kind ({error}).") from None
    if not rows or tuple(cell.strip() for cell in rows[0]) != COLUMNS:
        raise InputError(f"{path}: line 1: expected the columns {','.join(COLUMNS)}, got {','.join(rows[0])[:60] if rows else 'nothing'}.")
    found: dict[tuple[int, int], list[list[float]]] = {}
    for number, row in enumerate(rows[1:], start=2):
        if row:
            camera, line, x, y = _row(path, number, row)
            found.setdefault((camera - 1, line), []).append([x, y])
    return {key: np.array(points) for key, points in found.items()}


def _row(path: Path, number: int, row: list[str]) -> tuple[int, int, float, float]:
    try:
        camera, line, x, y = row
        values = (int(camera), int(line), float(x), float(y))
    except ValueError:
        values = (0, 0, math.nan, math.nan)
    if not (1 <= values[0] <= 64 and 0 <= values[1] <= 10**6 and abs(values[2]) < FARTHEST_PX and abs(values[3]) < FARTHEST_PX):
        raise InputError(f"{path}: line {number}: expected camera (from 1), line, x_px and y_px, got {','.join(row)[:60]!r}.")
    return values
