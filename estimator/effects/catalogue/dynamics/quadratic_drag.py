"""Drag proportional to the square of the speed, ``dv/dt = -c |v| v`` [Clift, Grace and Weber 1978]; Reynolds numbers above about 1000.

Valid in still air or, with a wind in the model, in air that moves, for a drag that does not depend on the attitude, without a torque.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.motion.rigid_body import sizes


class QuadraticDrag(EffectModel):
    """Newton drag with a constant coefficient."""

    entry = EFFECTS["quadratic_drag"]

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``-c |v| v``."""
        del setting
        u = moment.through_air
        return np.asarray(-theta * sizes(u) * u)
