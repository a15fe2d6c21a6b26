"""Whether the times of an observation can be seconds: how fast its outlines move, and how far a particle would fall meanwhile.

The calibrated views say how large the particle is, so an outline's size says how long a pixel is at the particle, whatever its
distance. Pictures are not read for this; of them only the time between two is checked.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import Frames, Observation, Recording

Array = NDArray[np.float64]

FASTEST_MS, LONGEST_INTERVAL_S = 150.0, 1.0
"""Of a particle, and between two rows of a trajectory or two pictures; medians are compared."""
PICTURES_FALLEN = 1000.0
"""Widths of the picture that a particle may fall in free flight while it is seen; one that comes to rest within the picture stays longer
than one that flies through, for seconds where a picture shows 0.1 m."""


@np.errstate(all="ignore")
def check_pace(obs: Observation, path: Path) -> None:
    """Check the median time between two pictures and, where there are outlines, speed and fall.

    Parameters
    ----------
    obs
        What was read; its times rise.
    path
        ``observation.json``, to be named in messages.

    Raises
    ------
    InputError
        When the times look like another unit than seconds.
    """
    size = _size_m(obs)
    for number, (camera, recording, clock) in enumerate(zip(obs.cameras, obs.recordings, obs.clocks, strict=True)):
        times, where = clock.times_s, f"{path}: at {'$' if clock is obs.clock else f'$.cameras[{number}]'}.clock.times_s"
        _check_interval(times, where)
        boxes = _boxes(recording)
        seen = np.flatnonzero(boxes[:, 2] > 0.0)  # an outline that is a single point tells no size
        if size is None or len(seen) < 2:
            continue
        metres = size / float(np.median(boxes[seen, 2]))
        _check_speed(boxes[:, :2] * metres, times, where)
        lasts, wide = float(times[seen[-1]] - times[seen[0]]), metres * max(camera.intrinsics.width_px, camera.intrinsics.height_px)
        fall = 0.5 * float(np.linalg.norm(obs.gravity_world)) * lasts**2
        if fall > PICTURES_FALLEN * wide:
            raise InputError(
                f"{where}: expected seconds, got {lasts:g} between the first and the last outline: a particle falls {fall:.3g} m in that "
                f'time, and camera "{camera.name}" sees {wide:.2g} m; are they ms or us?'
            )


def _check_interval(times: Array, where: str) -> None:
    interval = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    if not interval <= LONGEST_INTERVAL_S:
        raise InputError(f"{where}: expected seconds between pictures below {LONGEST_INTERVAL_S:g}, got {interval:g}; are they ms or us?")


def _check_speed(centres: Array, times: Array, where: str) -> None:
    speeds = [np.linalg.norm(centres[b] - centres[a]) / (times[b] - times[a]) for a, b in pairwise(range(len(times)))]
    known = [speed for speed in speeds if np.isfinite(speed)]
    if known and np.median(known) > FASTEST_MS:
        raise InputError(
            f"{where}: expected seconds, got times in which the outlines move at {np.median(known):.3g} m/s (at most {FASTEST_MS:g}); "
            "are they, or the calibrated views, in another unit?"
        )


def _size_m(obs: Observation) -> float | None:
    """The particle's extent (m) across the calibrated views: the median of them; ``None`` where no outline tells."""
    sizes = [
        box[2] * view.t_cam_particle[2] / view.intrinsics.fx_px for box, view in zip(_boxes(obs.view_recording), obs.views, strict=False)
    ]
    known = [size for size in sizes if np.isfinite(size) and size > 0]
    return float(np.median(known)) if known else None


def _boxes(recording: Recording) -> Array:
    """Middle (px) and larger side (px) of the box around each outline, (n, 3); NaN where there is none, no rows for pictures."""
    if isinstance(recording, Frames):
        return np.zeros((0, 3))
    return np.array([[np.nan] * 3 if outline.empty else _box(outline.points_px) for outline in recording]).reshape(-1, 3)


def _box(points: Array) -> list[float]:
    low, high = points.min(axis=0), points.max(axis=0)
    return [*((low + high) / 2), float((high - low).max())]
