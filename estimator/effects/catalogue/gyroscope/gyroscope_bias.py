"""A gyroscope that reads something at rest, ``reading = omega + b`` [IEEE Std 952 1997].

Valid for a bias that is the same all over a campaign; its drift with temperature is left out.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel


class GyroscopeBias(EffectModel):
    """A constant reading beside the angular velocity."""

    entry = EFFECTS["gyroscope_bias"]

    def reading(self, theta: Array, omega: Array) -> Array:
        """``omega + b``."""
        return omega + theta
