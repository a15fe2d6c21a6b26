"""Lift that grows less than the spin, ``dv/dt = C (omega x u) / (1 + l |omega| / |u|)``, u the velocity through the air [Nathan 2008].

With a ball's radius r and S = r omega / u, a lift coefficient S / (0.4 + 2.32 S), as measured on baseballs, has l = 5.8 r; at l = 0 it is
the lift of Rubinow and Keller. Valid for balls at spin numbers S up to about 1.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.motion.rigid_body import cross_product, sizes

LENGTHS_M = (0.01, 0.05, 0.25)
"""Where a search begins: 5.8 radii of balls from 2 mm to 4 cm."""
LEAST_LEFT = 0.1
"""Of a lift's denominator: steps of a fit may lead to lengths below zero, where lift would grow without bound. By judgement."""


class SaturatingLift(EffectModel):
    """Lift across spin and velocity that saturates with the spin number."""

    entry = EFFECTS["saturating_lift"]
    lifts = True
    contains = ("magnus_lift",)

    def starts(self, setting: Setting) -> Array:
        """Some lengths."""
        del setting
        return np.array([[0.0, length] for length in LENGTHS_M])

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``C omega x u / (1 + l |omega| / |u|)``."""
        del setting
        u = moment.through_air
        speed = np.maximum(sizes(u), 1e-12)
        left = np.maximum(1.0 + theta[:, 1:] * sizes(moment.omega) / speed, LEAST_LEFT)
        return np.asarray(theta[:, :1] * cross_product(moment.omega, u) / left)
