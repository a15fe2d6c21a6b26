"""Positions whose scale changes across what is measured: a plane that is filmed at an angle, cameras that were moved after calibration.

``x + R (q · u) u``, ``u = (x - c) / R``: a projective map to first order, without what is the same everywhere [Hartley and Zisserman 2004,
ch. 2 and 10]. A stick that was laid in one place tells the scale there. A free flight that is measured so is fitted by a small force that
goes with the square of its velocity. Valid where the scale changes by little; c and R are those of the positions themselves.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting


class Perspective(EffectModel):
    """A scale that grows along an axis."""

    entry = EFFECTS["perspective"]

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        """Further out where the scale is larger."""
        u = (x - setting.middle_world) / setting.reach_m
        return x + setting.reach_m * (u @ theta)[:, None] * u
