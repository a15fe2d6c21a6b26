"""Radial lens distortion beyond the stated one [Brown 1971]: ``x_d = x (1 + k1 r² + k2 r⁴)`` in normalised coordinates.

Valid where the map is one to one.
"""

import numpy as np

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel

ITERATIONS = 8
"""Of the inverse by substitution. By judgement."""


class RadialDistortion(EffectModel):
    """Barrel or pincushion."""

    entry = EFFECTS["radial_distortion"]

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Points with the distortion taken off by fixed-point iteration."""
        del times_s
        centre, focal = np.array([camera.cx_px, camera.cy_px]), np.array([camera.fx_px, camera.fy_px])
        distorted = (points_px - centre) / focal
        ideal = distorted
        for _ in range(ITERATIONS):
            r2 = np.sum(ideal**2, axis=1, keepdims=True)
            ideal = distorted / (1.0 + r2 * (theta[0] + r2 * theta[1]))
        return np.asarray(ideal * focal + centre)
