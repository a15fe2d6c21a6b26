"""Motion blur seen through a threshold other than one half: both edges across the motion move by bias times the blur's length."""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting


class MotionBlurThreshold(EffectModel):
    """``delta = bias |u . w| T``."""

    entry = EFFECTS["motion_blur_threshold"]
    accuracy = 0.1

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """Outline displacement by the blur."""
        across = np.abs(np.sum(places.normal * places.velocity_px, axis=-1))
        return np.asarray(theta[0] * across * setting.exposure_s)
