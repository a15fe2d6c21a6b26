"""Lengths of the calibrated views wrong by a factor: the particle in flight is (1 + s) times as large [Hartley and Zisserman 2004].

Depth takes the factor; only a known acceleration betrays it, as with the frame rate.

``X_true = (1 + s) X_stated``. Valid where all stated lengths of the views are wrong by one factor.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel


class LengthScale(EffectModel):
    """The particle is larger or smaller than its calibration."""

    entry = EFFECTS["length_scale"]

    def scale(self, theta: Array) -> float:
        """True size over calibrated size."""
        return 1.0 + float(theta[0])
