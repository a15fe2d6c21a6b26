"""Principal moments in another ratio than those of the uniform body: the spin's path bends otherwise [Goldstein 1980, ch. 5].

``I = (I1 (1 + e1), I2 (1 + e2), I3)``. Valid where principal axes stay those of the uniform body, and no moment
exceeds the sum of the others.
"""

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
