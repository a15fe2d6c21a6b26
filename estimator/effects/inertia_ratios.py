"""Principal moments in another ratio than those of the uniform body: the spin's path bends otherwise [Goldstein 1980, ch. 5]."""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, BodyChange, EffectModel, Setting


class InertiaRatios(EffectModel):
    """Relative change of the two smaller moments."""

    entry = EFFECTS["inertia_ratios"]

    def body(self, theta: Array, setting: Setting) -> BodyChange:
        """``E11`` and ``E22`` of the flight's inertia."""
        del setting
        return BodyChange(np.zeros(3), np.concatenate([theta, np.zeros(3)]))
