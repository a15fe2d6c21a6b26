"""Every number of a report as tables of comma-separated values: files beside the page, and downloads from it that are the same.

Numbers are in SI units but for residuals, which are pixels; nine digits.
"""

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from tumble.reports.record import Record
from tumble.reports.sequence_row import residual_rms_px
from tumble.reports.words import rms_ete_px

TABLES: dict[str, tuple[str, ...]] = {
    "sequences": ("sequence", "status", "message", "frames_used", "frames", "rms_ete_px", "rms_residual_px"),
    "velocities": ("sequence", "where", "quantity", "unit", "value", "sigma", "true"),
    "frames": (
        *("sequence", "camera", "frame", "time_s", "used", "reason", "rms_ete_px", "rms_whitened"),
        *("residual_rms_px", "residual_mean_px", "residual_largest_px"),
    ),
    "motion": (
        *("sequence", "frame", "time_s", "x_m", "y_m", "z_m", "q_x", "q_y", "q_z", "q_w"),
        *("v_x_ms", "v_y_ms", "v_z_ms", "omega_x_rads", "omega_y_rads", "omega_z_rads"),
    ),
    "parameters": ("sequence", "parameter", "value", "sigma"),
    "files_read": ("sequence", "file", "sha256"),
}
"""Names of the tables and of their columns."""

Rows = list[list[Any]]


def csv_rows(record: Record, shown: dict[str, Any]) -> dict[str, Rows]:
    """The rows of one sequence in every table."""
    parts = {
        "sequences": [_sequence(record, shown)],
        "velocities": [[v["heading"], row["label"], row["unit"], row["value"], row["sigma"], row["true"]] for v, row in _velocities(shown)],
        "frames": _frames(shown),
        "motion": _motion(record),
        "parameters": _parameters(record),
        "files_read": [list(entry) for entry in record.read],
    }
    return {name: [[record.estimate.name, *row] for row in rows] for name, rows in parts.items()}


def csv_text(name: str, rows: Iterable[Sequence[Any]]) -> str:
    """A table with its head."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(TABLES[name])
    writer.writerows([_cell(value) for value in row] for row in rows)
    return text.getvalue()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _sequence(record: Record, shown: dict[str, Any]) -> list[Any]:
    estimate = record.estimate
    used = sum(frame.used for frame in estimate.frames)
    return [estimate.status.value, estimate.message, used, len(estimate.frames), rms_ete_px(estimate), residual_rms_px(shown)]


def _velocities(shown: dict[str, Any]) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    return [(table, row) for table in shown["velocities"] for row in table["rows"]]


def _frames(shown: dict[str, Any]) -> Rows:
    return [
        [
            *(camera["name"], f["frame"], None if f["time_ms"] is None else f["time_ms"] / 1e3, f["used"], f["reason"], f["rms"]),
            *(f["whitened"], *(f["residual"] or [None] * 3)),
        ]
        for camera in shown["cameras"]
        for f in camera["frames"]
    ]


def _motion(record: Record) -> Rows:
    motion = record.estimate.motion
    if motion is None:
        return []
    columns = np.column_stack([motion.times_s, motion.x_world, motion.q_world_body, motion.v_world, motion.omega_world])
    return [[k, *row] for k, row in enumerate(columns.tolist())]


def _parameters(record: Record) -> Rows:
    estimate = record.estimate
    known = len(estimate.covariance) > 0
    sigma = np.sqrt(np.maximum(np.diag(estimate.covariance), 0.0)) if known else np.full(len(estimate.values), np.nan)
    return [[name, *numbers] for name, *numbers in zip(estimate.parameters, estimate.values.tolist(), sigma.tolist(), strict=True)]
