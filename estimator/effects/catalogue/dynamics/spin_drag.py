"""Drag that grows with the spin, ``dv/dt = -C |omega| u``, u the velocity through the air [Davies 1949].

That is a drag coefficient that grows with the spin number S = r omega / u, beside the drag of a ball that does not spin
(:mod:`estimator.effects.catalogue.dynamics.quadratic_drag`). Valid for balls at S up to about 1.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.motion.rigid_body import sizes


class SpinDrag(EffectModel):
    """Drag by the spin."""

    entry = EFFECTS["spin_drag"]

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``-C |omega| u``."""
        del setting
        return np.asarray(-theta * sizes(moment.omega) * moment.through_air)
