"""Positions of a tracker that are wrong by more the further they are from its middle, ``x + k (|x - c| / R)² (x - c)``.

Cameras whose radial distortion was calibrated not quite right leave such an error in the positions that are triangulated from them [Luhmann
et al. 2014]. Curved by it, free flight looks as if a force of some metres per square second acted. Valid for displacements that are small
against R, cameras about the volume; c and R are those of the positions themselves.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting


class PositionDistortion(EffectModel):
    """A radial distortion of the measured volume."""

    entry = EFFECTS["position_distortion"]

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        """``x + k (|x - c| / R)² (x - c)``."""
        away = x - setting.middle_world
        return x + theta[0] * ((away / setting.reach_m) ** 2).sum(axis=1, keepdims=True) * away
