"""Light of the background spilling over the rim, most where the back-light is brightest: ``delta = -b (1 - r² / R²)``.

Spilling light as in [Janesick, Scientific Charge-Coupled Devices (2001)]. Valid for a back-light that falls off
with the square of the radius.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting
from estimator.effects.receding import moved_outline


class Blooming(EffectModel):
    """Outlines that recede towards the picture's centre."""

    entry = EFFECTS["blooming"]
    accuracy = 0.05
    accuracy_at_spikes = 0.08

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """Recession by the brightness of the back-light."""
        del setting
        middle = places.seen.middle_px
        r2 = np.sum((places.point_px - middle[:, None, None]) ** 2, axis=-1)
        return moved_outline(-theta[0] * (1.0 - r2 / np.sum(middle**2, axis=1)[:, None, None]), places)
