"""Spins that were measured wrongly, another error in every sequence: ``measured = omega + |measured| e`` [Fuller 1987].

A spin that was read once, off marks on a ball, has an axis or a sign that is now and then a wrong one, by far more than its stated
uncertainty. The flight itself tells, where the spin acts on it. Valid for an error that is the same in all rows of a sequence.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting


class SpinError(EffectModel):
    """An error of the measured spin in every sequence."""

    entry = EFFECTS["spin_error"]

    def spun(self, theta: Array, omega: Array, setting: Setting) -> Array:
        """``omega + |measured| e``."""
        return omega + setting.spin_rads * theta
