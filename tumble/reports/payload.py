"""The data of a report's page: plain values, rounded to what a screen can show."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Frames
from datasets.vocabulary.state import Motion
from tumble.numbers import decimals, rounded
from tumble.reports.pictures import Window, crop_uri, follow
from tumble.reports.record import Record
from tumble.reports.velocity_tables import velocity_tables
from tumble.reports.words import meaning, next_steps, rms_ete_px

Array = NDArray[np.float64]
MINIMA = "competing_minima"
MINIMUM_WORDS = {"rms_ete_px": "RMS ETE, px", "cost": "cost per pair (1 is expected)"}
"""Headings of the columns that are known, in their order."""
HIDDEN = ("hull_vertices", "hull_faces", MINIMA)


def sequence_payload(record: Record, *, most_frames: int) -> dict[str, Any]:
    """Everything the page shows of one sequence; at most ``most_frames`` pictures per camera, evenly spread."""
    estimate = record.estimate
    rms = rms_ete_px(estimate)
    return {
        "name": estimate.name,
        "status": estimate.status.value,
        "meaning": meaning(estimate),
        "message": estimate.message,
        "next": next_steps(estimate),
        "rms_ete_px": None if rms is None else round(rms, 4),
        "used": sum(frame.used for frame in estimate.frames),
        "total": len(estimate.frames),
        "cameras": _cameras(record, most_frames),
        "trajectory": None if estimate.motion is None else _trajectory(estimate.motion),
        "true_trajectory": None if record.truth is None else _trajectory(record.truth.motion),
        "velocities": velocity_tables(estimate, record.truth),
        "minima": _minima(estimate.statistics.get(MINIMA)),
        "parameters": _parameters(record),
        "statistics": flat({key: value for key, value in estimate.statistics.items() if key not in HIDDEN}),
        "configuration": flat(estimate.configuration),
        "versions": flat(estimate.versions),
    }


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


def _finite(value: float, digits: int) -> float | None:
    return round(float(value), digits) if math.isfinite(value) else None


def _cameras(record: Record, most_frames: int) -> list[dict[str, Any]]:
    reports = record.estimate.frames
    if record.observation is None:
        names = [f"camera {number}" for number in sorted({frame.camera for frame in reports})]
    else:
        names = [camera.name for camera in record.observation.cameras]
    return [{"name": name, "frames": _frames(record, k), **_pictures(record, k, most_frames)} for k, name in enumerate(names)]


def _frames(record: Record, camera: int) -> list[dict[str, Any]]:
    clock = record.observation.clock.times_s if record.observation is not None else None
    return [
        {
            "frame": frame.frame,
            "time_ms": None if clock is None else round(float(clock[frame.frame]) * 1e3, 4),
            "used": frame.used,
            "reason": frame.reason,
            "rms": _finite(frame.rms_ete_px, 4),
            "whitened": _finite(frame.rms_whitened, 4),
        }
        for frame in record.estimate.frames
        if frame.camera == camera
    ]


def _pictures(record: Record, camera: int, most_frames: int) -> dict[str, Any]:
    """Pictures or outlines of one camera, every ``step``-th frame."""
    if record.observation is None:
        return {"pictures": [], "size": None}
    recording = record.observation.recordings[camera]
    intrinsics = record.observation.cameras[camera].intrinsics
    count = len(recording)
    estimated = list(record.outlines_px[camera]) if camera < len(record.outlines_px) else [None] * count
    observed = [None] * count if isinstance(recording, Frames) else [outline.points_px for outline in recording]
    windows = follow([e if e is not None else o for e, o in zip(estimated, observed, strict=True)], intrinsics)
    shown = range(0, count, max(1, math.ceil(count / most_frames)))
    pictures = [_picture(recording, k, windows[k], estimated[k], observed[k]) for k in shown]
    return {"pictures": pictures, "size": [intrinsics.width_px, intrinsics.height_px]}


def _picture(recording: Any, index: int, window: Window, estimated: Array | None, observed: Array | None) -> dict[str, Any]:
    return {
        "frame": index,
        "window": [window.x_px, window.y_px, window.side_px],
        "image": crop_uri(recording, index, window) if isinstance(recording, Frames) else None,
        "estimated": _polygon(estimated),
        "observed": _polygon(observed),
    }


def _polygon(points: Array | None) -> list[float] | None:
    return None if points is None or not len(points) else [round(float(value), 1) for value in points.ravel()]


def _trajectory(motion: Motion) -> dict[str, Any]:
    return {
        "x_mm": [[round(float(value) * 1e3, 4) for value in row] for row in motion.x_world],
        "q": [[round(float(value), 4) for value in row] for row in motion.q_world_body],
    }


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
