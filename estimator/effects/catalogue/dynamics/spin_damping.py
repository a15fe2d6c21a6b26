"""Torque against the spin, ``dL/dt = -b L``: what a viscous fluid does to a sphere [Lamb 1932, art. 334].

Valid for one rate about all axes.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting


class SpinDamping(EffectModel):
    """Exponential decay of the angular momentum."""

    entry = EFFECTS["spin_damping"]

    def torque(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``-b L``."""
        del setting
        return -theta * moment.L
