"""Gravity of another size or direction than stated: a camera that is not level, or a wrong constant.

``dv/dt = g_stated + dg`` [Goldstein 1980, ch. 1]. Valid where gravity is uniform.

Half a metre per second squared is plausible: a camera that is level to three degrees. Its size is 9.78 to 9.83 m/s² at sea level
[Moritz, J. Geod. 74 (2000) 128]; more than that, but within the range, a wrong length or clock may say.
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
