"""Whether a picture that is to be the background shows a particle that stood still while it was taken.

Where the background has the particle, every later picture without it there differs from the background the other way than the particle
differs from what is behind it: back-lit, the place is brighter than the background. A ghost of the particle's kind is looked for in
pictures spread over the recording.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.outlines.settings import OutlineSettings

SHOWN = 0.5
"""Share of the pictures in which a ghost has to be seen: what moves is at one place in fewer."""
LEAST_SHARE = 0.3
"""Of the area that moves: a smaller ghost is dust that came or went, not the particle."""
NOISES = 6.0
"""Standard deviations of a pixel's noise from which a difference is no noise; a patch of many such pixels is needed besides."""


def ghost_px(background: NDArray[np.uint16], pictures: Sequence[NDArray[np.uint16]]) -> Float[NDArray[np.float64], "2"] | None:
    """Where (x, y) px the ``background`` has a particle that later ``pictures`` do not have there; ``None`` where that is nowhere.

    What differs at a place in fewer than half of the pictures is the particle that moves; it says whether particles are darker than what is
    behind them. A patch that differs the other way in at least half of them is the ghost.
    ``background``, ``pictures`` (height, width) DN.
    """
    level = background.astype(np.float32)
    darker, brighter = np.zeros(level.shape, np.int32), np.zeros(level.shape, np.int32)
    for picture in pictures:
        difference = picture.astype(np.float32) - level
        difference -= np.median(difference)
        strong = np.abs(difference) > NOISES * max(1.4826 * float(np.median(np.abs(difference))), 1.0)
        darker += strong & (difference < 0)
        brighter += strong & (difference > 0)
    least = SHOWN * len(pictures)
    moving = [int(each[each < least].sum()) / len(pictures) for each in (darker, brighter)]
    dark_particle = moving[0] >= moving[1]
    stays = ((brighter if dark_particle else darker) >= least).astype(np.uint8)
    number, _, stats, centres = cv2.connectedComponentsWithStats(cv2.morphologyEx(stays, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))
    if number < 2:
        return None
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    large = stats[largest, cv2.CC_STAT_AREA] >= max(OutlineSettings().least_area_px2, LEAST_SHARE * max(moving))
    return np.asarray(centres[largest], dtype=np.float64) if large else None
