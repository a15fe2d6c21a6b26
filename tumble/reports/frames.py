"""The frames of a report's page: of every one its errors, and of those that are shown the picture, both outlines and residuals."""

import math
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from datasets.observation import Frames
from tumble.reports.packed import DISTANCE_STEPS, packed, packed_points
from tumble.reports.pictures import Window, crop_uri, follow
from tumble.reports.record import Record
from tumble.reports.residuals import Residuals

Array = NDArray[np.float64]
SIMPLER_PX = 0.03
"""By how much a drawn outline may be off, far below the width of its line."""
MOST_WHISKERS = 90
"""Residuals drawn along one outline: a few pixels of the screen apart."""


def cameras(record: Record, most_frames: int) -> list[dict[str, Any]]:
    """Every camera with its frames and its pictures, at most ``most_frames`` of them, evenly spread."""
    if record.observation is None:
        names = [f"camera {number}" for number in sorted({frame.camera for frame in record.estimate.frames})]
    else:
        names = [camera.name for camera in record.observation.cameras]
    return [{"name": name, "frames": _frames(record, k), **_pictures(record, k, most_frames)} for k, name in enumerate(names)]


def _frames(record: Record, camera: int) -> list[dict[str, Any]]:
    clock = record.observation.clock_of(camera).times_s if record.observation is not None else None
    return [
        {
            "frame": frame.frame,
            "time_ms": None if clock is None else round(float(clock[frame.frame]) * 1e3, 4),
            "used": frame.used,
            "reason": frame.reason,
            "rms": _finite(frame.rms_ete_px),
            "whitened": _finite(frame.rms_whitened),
            "residual": _summary(record.residuals(camera, frame.frame)),
        }
        for frame in record.estimate.frames
        if frame.camera == camera
    ]


def _summary(residuals: Residuals | None) -> list[float] | None:
    """RMS, mean and largest distance (px) between the outlines."""
    return None if residuals is None else [round(value, 4) for value in (residuals.rms_px, residuals.mean_px, residuals.largest_px)]


def _finite(value: float) -> float | None:
    return round(float(value), 4) if math.isfinite(value) else None


def _pictures(record: Record, camera: int, most_frames: int) -> dict[str, Any]:
    """Pictures and outlines of one camera, every ``step``-th frame."""
    if record.observation is None:
        return {"pictures": [], "size": None}
    lens, count = record.observation.cameras[camera].intrinsics, len(record.observation.recordings[camera])
    either = [_first(record.estimated(camera, k), record.seen(camera, k)) for k in range(count)]
    windows = follow(either, lens)
    shown = range(0, count, max(1, math.ceil(count / most_frames)))
    return {"pictures": [_picture(record, camera, k, windows[k]) for k in shown], "size": [lens.width_px, lens.height_px]}


def _first(one: Array | None, other: Array | None) -> Array | None:
    return one if one is not None else other


def _picture(record: Record, camera: int, index: int, window: Window) -> dict[str, Any]:
    assert record.observation is not None
    recording = record.observation.recordings[camera]
    return {
        "frame": index,
        "window": [window.x_px, window.y_px, window.side_px],
        "image": crop_uri(recording, index, window) if isinstance(recording, Frames) else None,
        "estimated": _drawn(record.estimated(camera, index), window),
        "seen": _drawn(record.seen(camera, index), window),
        "whiskers": _whiskers(record.residuals(camera, index), window),
    }


def _drawn(points: Array | None, window: Window) -> str | None:
    if points is None or len(points) < 3:
        return None
    return packed_points(shapely.get_coordinates(shapely.LinearRing(points).simplify(SIMPLER_PX))[:-1], window)


def _whiskers(residuals: Residuals | None, window: Window) -> dict[str, str] | None:
    """Some residuals, evenly spread along the outline: from the estimated outline to what was seen."""
    if residuals is None:
        return None
    n = len(residuals.distance_px)
    some = np.unique(np.linspace(0, n, min(n, MOST_WHISKERS), endpoint=False).astype(int))
    return {
        "from": packed_points(residuals.nearest_px[some], window),
        "to": packed_points(residuals.seen_px[some], window),
        "px": packed(DISTANCE_STEPS * residuals.distance_px[some]),
    }
