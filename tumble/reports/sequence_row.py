"""One sequence as a row of the page's table: texts, and the numbers that the table is sorted by."""

from typing import Any

import numpy as np

from tumble.reports.record import Record
from tumble.reports.words import rms_ete_px

Cell = tuple[str, float | str | None]
"""What a cell says and what it is sorted by; ``None``: last, in either direction."""
NOTHING: Cell = ("–", None)
HEADS = ("frames used", "RMS ETE, px", "RMS residual, px", "speed, m/s", "spin, rad/s")
TRUE_HEADS = ("error of v", "error of ω")
"""Of those sequences whose truth is known: length of the error over the length of the true vector, at the middle."""


def sequence_row(record: Record, shown: dict[str, Any]) -> dict[str, Any]:
    """Name, status and the cells under :data:`HEADS` and :data:`TRUE_HEADS`."""
    estimate = record.estimate
    used, total = sum(frame.used for frame in estimate.frames), len(estimate.frames)
    middle = shown["velocities"][-1]["rows"] if estimate.middle is not None else []
    cells = [
        (f"{used} of {total}", used),
        _number(rms_ete_px(estimate), "{:.2f}"),
        _number(residual_rms_px(shown), "{:.2f}"),
        *((row["text"], row["value"]) for row in middle[6:8]),
    ]
    cells += [NOTHING] * (len(HEADS) - len(cells))
    return {
        "name": estimate.name,
        "status": estimate.status.value,
        "cells": cells,
        "true_cells": [_error(middle[rows]) for rows in (slice(0, 3), slice(3, 6))],
    }


def residual_rms_px(shown: dict[str, Any]) -> float | None:
    """Root mean square over the frames in use of the distances between the outlines, px."""
    frames = [frame for camera in shown["cameras"] for frame in camera["frames"] if frame["used"] and frame["residual"] is not None]
    return float(np.sqrt(np.mean([frame["residual"][0] ** 2 for frame in frames]))) if frames else None


def _number(value: float | None, form: str) -> Cell:
    return NOTHING if value is None else (form.format(value), value)


def _error(rows: list[dict[str, Any]]) -> Cell:
    """Length of the error of a vector over that of the true one, in percent."""
    if not rows or any(row["true"] is None or row["value"] is None for row in rows):
        return NOTHING
    true, value = (np.array([row[key] for row in rows]) for key in ("true", "value"))
    length = float(np.linalg.norm(true))
    return NOTHING if length == 0.0 else _number(100.0 * float(np.linalg.norm(value - true)) / length, "{:.2f} %")
