"""Drag that goes with lift, ``dv/dt = -ratio |l| u / |u|``, l the lift's acceleration, u the velocity through the air [Davies 1949].

Drag and lift coefficients of a ball both grow with the spin number S = r omega / u, so one is told by the other: by the lift that a flight
shows even where its spin was misread. It adds to the drag of a ball that does not spin
(:mod:`estimator.effects.catalogue.dynamics.quadratic_drag`) and does nothing without a lift. Valid for balls at S up to about 1, and for a
spin that is not along the flight.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.motion.rigid_body import sizes


class InducedDrag(EffectModel):
    """Drag by the lift of all other effects."""

    entry = EFFECTS["induced_drag"]
    of_lift = True

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``-ratio |l| u / |u|``."""
        del setting
        if moment.lift is None:
            return None
        u = moment.through_air
        return np.asarray(-theta * sizes(moment.lift) * u / np.maximum(sizes(u), 1e-12))
