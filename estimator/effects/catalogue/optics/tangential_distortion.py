"""Decentring lens distortion beyond the stated one [Brown 1971].

``dx = 2 p1 x y + p2 (r² + 2 x²)``, ``dy = p1 (r² + 2 y²) + 2 p2 x y``, normalised coordinates. Valid for small angles.
"""

import numpy as np

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel

ITERATIONS = 8
"""Of the inverse by substitution. By judgement."""


class TangentialDistortion(EffectModel):
    """What a lens tilted or off its axis adds."""

    entry = EFFECTS["tangential_distortion"]

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Points with the distortion taken off by fixed-point iteration."""
        del times_s
        p1, p2 = theta
        centre, focal = np.array([camera.cx_px, camera.cy_px]), np.array([camera.fx_px, camera.fy_px])
        distorted = (points_px - centre) / focal
        ideal = distorted
        for _ in range(ITERATIONS):
            x, y = ideal.T
            r2 = x * x + y * y
            ideal = distorted - np.column_stack([2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y])
        return np.asarray(ideal * focal + centre)
