"""Drag proportional to the velocity, ``dv/dt = -k v`` [Stokes 1851]; holds for Reynolds numbers below about 1.

Valid in still air or, with a wind in the model, in air that moves; without a torque.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting


class LinearDrag(EffectModel):
    """Stokes drag."""

    entry = EFFECTS["linear_drag"]

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``-k v``."""
        del setting
        return -theta * moment.through_air
