"""A focal length other than stated; nearly degenerate with depth for one distant camera [Hartley and Zisserman 2004, ch. 6].

``f = (1 + r) f_stated``. Valid for a thin lens whose distortion is stated.
"""

import numpy as np

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel


class FocalLength(EffectModel):
    """Magnification about the principal point."""

    entry = EFFECTS["focal_length"]

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Points with the magnification taken off."""
        del times_s
        centre = np.array([camera.cx_px, camera.cy_px])
        return np.asarray(centre + (points_px - centre) / (1.0 + theta[0]))
