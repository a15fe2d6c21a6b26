"""Positions whose scale changes across what is measured: a plane that is filmed at an angle, cameras that were moved after calibration.

``c + R u / (1 - q · u)``, ``u = (x - c) / R``: a projective map without what is the same everywhere [Hartley and Zisserman 2004, ch. 2 and
10]. A plane that is filmed from a distance D and turned by an angle ``a`` has ``q = R sin(a) / D`` along the side that is nearer. A stick
that was laid in one place tells the scale there. A free flight that is measured so is fitted by a small force that goes with the square of
its velocity. Valid where ``q · u`` is below one. c and R are those of the positions themselves: elsewhere the scale is another one.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting


class Perspective(EffectModel):
    """A scale that grows along an axis."""

    entry = EFFECTS["perspective"]

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        """Further out where the scale is larger."""
        arm = x - setting.middle_world
        return setting.middle_world + arm / (1.0 - (arm @ theta)[:, None] / setting.reach_m)
