"""A constant acceleration of its own in every sequence: a charge in a field, a steady draught, an accelerated camera.

``dv/dt = g + a`` [Goldstein 1980, ch. 4]. Valid where it is steady during a sequence and turns nothing.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting


class UniformAcceleration(EffectModel):
    """An acceleration that differs from sequence to sequence."""

    entry = EFFECTS["uniform_acceleration"]
    constant = True
    contains = ("gravity",)

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The acceleration itself."""
        del moment, setting
        return theta
