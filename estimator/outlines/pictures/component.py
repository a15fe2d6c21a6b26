"""Which connected patch of departing pixels is the particle."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from estimator.outlines.result import FrameStatus
from estimator.outlines.settings import OutlineSettings

Mask = Bool[NDArray[np.bool_], "height width"]
_CLOSING = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))


@dataclass(frozen=True)
class Place:
    """Where a particle is: centroid (2,) px, bounding box (left, top, right, bottom; px, right and bottom excluded), area px²."""

    centre_px: Float[NDArray[np.float64], "2"]
    box: tuple[int, int, int, int]
    area_px2: float


def particle_mask(covered: Mask, settings: OutlineSettings, *, expected: Place | None) -> Mask | FrameStatus:
    """The particle's pixels, holes filled, or why none can be named.

    With ``expected`` (same coordinates) the candidate nearest to it counts, if its area is within a factor of three;
    without, the largest one, unless it has a rival.
    """
    closed = cv2.morphologyEx(covered.astype(np.uint8), cv2.MORPH_CLOSE, _CLOSING)
    shapes = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    areas = np.array([_pixel_area(s) for s in shapes])
    large = np.flatnonzero(areas >= settings.least_area_px2)
    if len(large) == 0:
        return FrameStatus.ABSENT
    choice = _largest(areas[large], settings) if expected is None else _nearest([shapes[i] for i in large], areas[large], expected)
    if isinstance(choice, FrameStatus):
        return choice
    mask = cv2.drawContours(np.zeros_like(closed), shapes, int(large[choice]), 1, cv2.FILLED)
    return np.asarray(mask > 0, dtype=bool)


def place_of(mask: Mask, origin: tuple[int, int] = (0, 0)) -> Place:
    """Place of the pixels in ``mask``, whose first pixel is at ``origin`` (column, row)."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    moments = cv2.moments(mask.astype(np.uint8), binaryImage=True)
    centre = np.array([moments["m10"], moments["m01"]]) / moments["m00"] + origin
    left, top = origin
    box = (int(columns[0]) + left, int(rows[0]) + top, int(columns[-1]) + left + 1, int(rows[-1]) + top + 1)
    return Place(centre, box, float(moments["m00"]))


def _pixel_area(shape: NDArray[np.int32]) -> float:
    """Pixels inside of a traced border, by Pick's theorem."""
    return float(cv2.contourArea(shape)) + len(shape) / 2 + 1


def _largest(areas: NDArray[np.float64], settings: OutlineSettings) -> int | FrameStatus:
    order = np.argsort(areas)[::-1]
    if len(order) > 1 and areas[order[1]] > settings.rival_share * areas[order[0]]:
        return FrameStatus.SEVERAL
    return int(order[0])


def _nearest(shapes: list[NDArray[np.int32]], areas: NDArray[np.float64], expected: Place) -> int | FrameStatus:
    centres = np.array([s[:, 0, :].mean(axis=0) for s in shapes])
    distance = np.hypot(*(centres - expected.centre_px).T)
    similar = (areas > expected.area_px2 / 3) & (areas < 3 * expected.area_px2)
    if not similar.any():
        return FrameStatus.ABSENT if areas.max() < expected.area_px2 else FrameStatus.SEVERAL
    return int(np.argmin(np.where(similar, distance, np.inf)))
