"""The data of a report's page: plain values, rounded to what a screen can show."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate
from datasets.vocabulary.state import Motion
from tumble.numbers import decimals, rounded
from tumble.reports.body_shape import body_shape
from tumble.reports.csv_tables import csv_rows
from tumble.reports.frames import cameras
from tumble.reports.record import Record
from tumble.reports.sequence_row import sequence_row
from tumble.reports.velocity_tables import velocity_tables
from tumble.reports.words import besides_status, meaning, next_steps

Array = NDArray[np.float64]
MINIMA = "competing_minima"
MINIMUM_WORDS = {"rms_ete_px": "RMS ETE, px", "cost": "cost per pair (1 is expected)"}
"""Headings of the columns that are known, in their order."""


def sequence_parts(record: Record, *, most_frames: int) -> dict[str, Any]:
    """What the page needs of one sequence: ``row`` of the table, ``shown`` once it is picked, ``csv`` rows of every table."""
    shown = sequence_payload(record, most_frames=most_frames)
    return {"row": sequence_row(record, shown), "shown": shown, "csv": csv_rows(record, shown)}


def sequence_payload(record: Record, *, most_frames: int) -> dict[str, Any]:
    """Everything the page shows of one sequence; at most ``most_frames`` pictures per camera, evenly spread."""
    estimate = record.estimate
    return {
        "name": estimate.name,
        "status": estimate.status.value,
        "meaning": meaning(estimate),
        "message": besides_status(estimate),
        "next": next_steps(estimate),
        "cameras": cameras(record, most_frames),
        "body": _body(record),
        "trajectory": None if estimate.motion is None else _trajectory(estimate.motion, record),
        "true_trajectory": None if record.truth is None else _trajectory(record.truth.motion, record),
        "world": _world_words(record),
        "impacts": _impact_frames(estimate),
        "velocities": velocity_tables(estimate, record.truth),
        "minima": _minima(estimate.statistics.get(MINIMA)),
        "parameters": _parameters(record),
        "statistics": flat({key: value for key, value in estimate.statistics.items() if key != MINIMA}),
        "configuration": flat(estimate.configuration),
        "versions": flat(estimate.versions),
        "read": [list(entry) for entry in record.read],
    }


def _body(record: Record) -> dict[str, Any] | None:
    """The body as it is shown, and which surface it is."""
    if record.surface is None or record.estimate.body is None:
        return None
    called = "visual hull of the views" if record.estimate.surface is None else "surface of the last fit"
    return body_shape(record.surface, record.estimate.body, called=called)


def flat(value: Any, name: str = "") -> list[list[str]]:
    """Nested values as rows of dotted name and text; long lists are told by their length."""
    if isinstance(value, dict):
        return [row for key, entry in value.items() for row in flat(entry, f"{name}.{key}" if name else str(key))]
    if isinstance(value, list | tuple | np.ndarray) and np.size(np.asarray(value, dtype=object)) > 12:
        return [[name, f"{len(value)} entries"]]
    if isinstance(value, list | tuple | np.ndarray):
        return [[name, ", ".join(_text(entry) for entry in value)]]
    return [[name, _text(value)]]


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _trajectory(motion: Motion, record: Record) -> dict[str, Any]:
    """Along the first camera's axes; where there is no observation, these are taken for the world's."""
    R, t = _first_camera(record)
    return {
        "x_mm": _rounded_rows((motion.x_world @ R.T + t) * 1e3),
        "q": _rounded_rows((Rotation.from_matrix(R) * Rotation.from_quat(motion.q_world_body)).as_quat()),
        "omega": _rounded_rows(motion.omega_world @ R.T),
    }


def _first_camera(record: Record) -> tuple[Array, Array]:
    """``R_cam_world`` and ``t_cam_world`` (m) of the first camera."""
    if record.observation is None:
        return np.eye(3), np.zeros(3)
    camera = record.observation.cameras[0]
    return np.asarray(camera.R_cam_world), np.asarray(camera.t_cam_world)


def _world_words(record: Record) -> str:
    """In which frame velocities are given."""
    R, t = _first_camera(record)
    if record.observation is None:
        return "World frame."
    same = np.allclose(R, np.eye(3)) and np.allclose(t, 0.0)
    return "World frame, which is the first camera's." if same else "World frame, which is not the first camera's."


def _impact_frames(estimate: Estimate) -> list[float]:
    """At which frame each impact is, in fractions of frames."""
    times_s = np.zeros(0) if estimate.motion is None else estimate.motion.times_s
    if not len(times_s):
        return []
    return [round(float(np.interp(impact.time_s, times_s, np.arange(len(times_s)))), 2) for impact in estimate.impacts]


def _rounded_rows(rows: Any) -> list[list[float]]:
    return [[round(float(value), 4) for value in row] for row in rows]


def _minima(found: Any) -> dict[str, Any] | None:
    """Competing minima as a table, whatever their columns are called."""
    if not isinstance(found, list | tuple) or not found or not all(isinstance(entry, dict) for entry in found):
        return None
    keys = list(dict.fromkeys(key for entry in found for key in entry))
    keys.sort(key=lambda key: list(MINIMUM_WORDS).index(key) if key in MINIMUM_WORDS else len(MINIMUM_WORDS))
    columns = [MINIMUM_WORDS.get(key, key.replace("_", " ")) for key in keys]
    return {"columns": columns, "rows": [[_cell(entry.get(key, "")) for key in keys] for entry in found]}


def _cell(value: Any) -> str:
    entries = np.ravel(np.asarray(value, dtype=object))
    return ", ".join(f"{entry:.4g}" if isinstance(entry, float) else str(entry) for entry in entries)


def _parameters(record: Record) -> list[list[str]]:
    estimate = record.estimate
    known = len(estimate.covariance) > 0
    sigma = np.sqrt(np.maximum(np.diag(estimate.covariance), 0.0)) if known else np.full(len(estimate.values), np.nan)
    rows = zip(estimate.parameters, estimate.values, sigma, strict=True)
    return [[name, rounded(value, spread), f"{spread:.{decimals(spread)}f}"] for name, value, spread in rows]
