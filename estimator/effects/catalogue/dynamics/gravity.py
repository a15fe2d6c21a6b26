"""Gravity of another size or direction than stated: a camera that is not level, or a wrong constant.

``dv/dt = g_stated + dg`` [Goldstein 1980, ch. 1]. Valid where gravity is uniform.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting


class Gravity(EffectModel):
    """A correction of the gravity vector, the same in all sequences."""

    entry = EFFECTS["gravity"]
    constant = True

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The correction."""
        del moment, setting
        return theta
