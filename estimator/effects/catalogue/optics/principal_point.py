"""The optical axis meets the picture elsewhere than stated [Hartley and Zisserman 2004, ch. 6].

For one distant camera it is a turn of the camera by a small angle: seen only through depth that changes and through known gravity.

``u = f x / z + cx + dx``, and v likewise. Valid for any displacement that leaves the particle in the picture.
"""

import numpy as np

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel


class PrincipalPoint(EffectModel):
    """Displacement of the principal point."""

    entry = EFFECTS["principal_point"]

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Points moved back."""
        del camera, times_s
        return points_px - theta

    def picture_moves(self, theta: Array, times_s: Array) -> Array:
        """All alike."""
        return np.broadcast_to(theta, (len(times_s), 2))
