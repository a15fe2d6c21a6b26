"""Outlines of frames and views, as rivals see them: given ones, or the half-way contour of pictures."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from skimage.filters import threshold_otsu
from skimage.measure import find_contours

from datasets.observation import Frames, Observation, Recording
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import oriented

Array = NDArray[np.float64]
SUPPORTS = 96
"""Directions in which the extreme points of an outline are kept: between two of them the hull of an outline of 100 px loses 0.05 px."""


@dataclass(frozen=True)
class Seen:
    """Frames of the first camera in which the whole outline is seen.

    ``times_s`` (f,) from the first time of the clock; ``outlines``: f polygons (n, 2), px; ``rows`` (f,) of the clock.
    """

    times_s: Float[NDArray[np.float64], " f"]
    outlines: list[Array]
    rows: NDArray[np.int64]


def frames_seen(obs: Observation) -> Seen:
    """What the first camera recorded, without frames that are empty or cut off by the picture's edge.

    Raises
    ------
    ValueError
        Where fewer than five are left.
    """
    inside = obs.cameras[0].intrinsics
    outlines = outlines_of(obs.recordings[0])
    rows = [k for k, outline in enumerate(outlines) if len(outline) and _whole(outline, inside)]
    if len(rows) < 5:
        raise ValueError(f"expected 5 frames with the whole particle in them, got {len(rows)}")
    times = obs.clock.times_s - obs.clock.times_s[0]
    return Seen(times[rows], [outlines[k] for k in rows], np.array(rows, dtype=np.int64))


def outlines_of(recording: Recording) -> list[Array]:
    """A polygon (n, 2) (px) for each entry; (0, 2) where there is none."""
    if isinstance(recording, Frames):
        return [_contour(recording.read(k), recording.background_of(k)) for k in range(len(recording))]
    return [outline.points_px for outline in recording]


def support_points(outline: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], "s 2"]:
    """The point (px) that lies farthest out in each of :data:`SUPPORTS` directions of the picture."""
    angles = 2 * np.pi * np.arange(SUPPORTS) / SUPPORTS
    return outline[np.argmax(outline @ np.array([np.cos(angles), np.sin(angles)]), axis=0)]


def area_and_centroid(outline: Float[NDArray[np.float64], "n 2"]) -> tuple[float, Array]:
    """Area (px²) and centroid (2,) (px) of a polygon."""
    middle = outline.mean(axis=0)
    moments = cv2.moments((outline - middle).astype(np.float32).reshape(-1, 1, 2))
    return moments["m00"], middle + np.array([moments["m10"], moments["m01"]]) / moments["m00"]


def rays(intrinsics: Intrinsics, points_px: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], "n 3"]:
    """Unit directions in camera coordinates in which points (px) are seen."""
    xy = intrinsics.normalise(points_px)
    found = np.column_stack([xy, np.ones(len(xy))])
    return found / np.linalg.norm(found, axis=1)[:, None]


def _contour(picture: NDArray[np.uint16], background: NDArray[np.uint16] | None) -> Array:
    """The longest contour half-way between the object and its background; (0, 2) where nothing stands out."""
    level = picture.astype(np.float64)
    difference = np.abs(level - (np.median(level) if background is None else background.astype(np.float64)))
    if np.ptp(difference) == 0:
        return np.zeros((0, 2))
    split = threshold_otsu(difference)
    inside = difference > split
    half = 0.5 * (np.median(difference[inside]) + np.median(difference[~inside]))
    found = find_contours(difference, half)
    return oriented(max(found, key=len)[:-1, ::-1]) if found else np.zeros((0, 2))


def _whole(outline: Array, inside: Intrinsics) -> bool:
    low, high = outline.min(axis=0), outline.max(axis=0)
    return bool(np.all(low > 1) and high[0] < inside.width_px - 2 and high[1] < inside.height_px - 2)
