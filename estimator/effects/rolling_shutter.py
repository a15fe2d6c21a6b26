"""Rows exposed one after the other [Ait-Aider et al. 2006]: row y at ``t + line_time (y - (height - 1) / 2)``."""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting


class RollingShutter(EffectModel):
    """Outline displacement by the movement since the middle row."""

    entry = EFFECTS["rolling_shutter"]

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """``u . w`` times the row's delay."""
        del setting
        delay = theta[0] * (places.point_px[..., 1] - (places.camera.height_px - 1) / 2)
        return np.asarray(np.sum(places.normal * places.velocity_px, axis=-1) * delay)
