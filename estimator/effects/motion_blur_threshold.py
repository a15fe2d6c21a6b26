"""Motion blur seen through a threshold other than one half: both edges across the motion move by bias times the blur's length.

Corners that are narrow across the motion recede by more, at the half level, too: that is tabled by the level from the outlines that the
body casts (:mod:`estimator.geometry.outline_smear`). A bias of zero stands for outlines of the exposure's middle, as they are without the
effect.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting
from estimator.effects.receding import tabled
from estimator.geometry.outline_smear import LEVELS


class MotionBlurThreshold(EffectModel):
    """``delta = bias |u . w| T`` less what corners lose."""

    entry = EFFECTS["motion_blur_threshold"]
    accuracy = 0.1
    accuracy_at_spikes = 0.3

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """Outline displacement by the blur."""
        bias = float(theta[0])
        if bias == 0.0:
            return np.zeros(places.radius_px.shape)
        across = np.abs(np.sum(places.normal * places.velocity_px, axis=-1))
        lost = tabled(places.smear, np.full(across.shape, 0.5 - bias), LEVELS)
        return np.asarray(bias * across * setting.exposure_s - lost)
