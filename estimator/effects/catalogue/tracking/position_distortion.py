"""Positions of a tracker that are wrong by more the further they are from its middle: radial and decentring distortion of the volume.

``x + R (k |u|² u + |u|² p + 2 (p · u) u)``, ``u = (x - c) / R``: Brown's terms of a lens [Brown 1971], in space. What a calibration of
cameras leaves of their distortion makes positions that are triangulated from them wrong in this way [Luhmann et al. 2014]. A free flight
that is measured in such a volume is fitted by a small force. Valid for displacements that are small against R, cameras about the volume;
c and R are those of the positions themselves.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting


class PositionDistortion(EffectModel):
    """A distortion of the measured volume."""

    entry = EFFECTS["position_distortion"]

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        """Radial, then decentring."""
        u = (x - setting.middle_world) / setting.reach_m
        squares = (u**2).sum(axis=1, keepdims=True)
        return x + setting.reach_m * (theta[0] * squares * u + squares * theta[1:] + 2.0 * (u @ theta[1:])[:, None] * u)
