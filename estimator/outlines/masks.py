"""Outlines of masks that a user has made: bright where the particle is, of two values or with grey edges.

The contour at half of the brightest value is traced; of two values it runs midway between pixels and is off by up to half a pixel, which
its roughness tells the estimator.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.outline import Outline
from estimator.outlines.pictures.contour import half_level_contour
from estimator.outlines.result import EMPTY
from estimator.outlines.settings import OutlineSettings


def outline_of_mask(mask: NDArray[np.uint16], *, full: float | None = None) -> Outline:
    """The outer outline (px) of the largest bright patch of ``mask`` (height, width); empty where there is none.

    ``full`` is the value inside the particle, the brightest one where it is not given. Patches smaller than what counts as dust in pictures
    are none. A patch at the picture's edge ends there.
    """
    full = float(mask.max()) if full is None else full
    if full <= 0.0:
        return EMPTY
    occupancy = np.minimum(mask.astype(np.float32) / np.float32(full), 1.0)
    number, labels, stats, _ = cv2.connectedComponentsWithStats((occupancy >= 0.5).astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    if number < 2 or areas.max() < OutlineSettings().least_area_px2:
        return EMPTY
    chosen = labels == 1 + int(np.argmax(areas))
    near = cv2.dilate(chosen.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    contour = half_level_contour(np.pad(np.where(near, occupancy, np.float32(0.0)), 1))
    return EMPTY if contour is None else Outline(contour - 1.0)
