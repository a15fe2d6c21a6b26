"""Pixels that are not as square as stated: ``fy`` is (1 + a) times the stated one.

``v = fy (1 + a) y / z + cy`` [Hartley and Zisserman 2004, ch. 6]. Valid where axes are perpendicular.
"""

import numpy as np

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel


class PixelAspect(EffectModel):
    """Stretch of the picture along y."""

    entry = EFFECTS["pixel_aspect"]

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Points with the stretch taken off."""
        del times_s
        y = camera.cy_px + (points_px[:, 1] - camera.cy_px) / (1.0 + theta[0])
        return np.column_stack([points_px[:, 0], y])
