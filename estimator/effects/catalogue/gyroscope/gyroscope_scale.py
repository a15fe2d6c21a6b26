"""A gyroscope whose axes read too much or too little, ``reading_i = omega_i (1 + s_i)`` [IEEE Std 952 1997].

Valid for axes that are at right angles to one another and along the tracked frame's.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel


class GyroscopeScale(EffectModel):
    """A factor for each axis."""

    entry = EFFECTS["gyroscope_scale"]

    def reading(self, theta: Array, omega: Array) -> Array:
        """``omega (1 + s)``."""
        return omega * (1.0 + theta)
