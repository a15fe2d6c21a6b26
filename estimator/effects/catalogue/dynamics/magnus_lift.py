"""Lift of a spinning body, ``dv/dt = C (omega x v)`` [Rubinow and Keller 1961]: C is (3/8) rho_air / rho for a slow sphere.

Valid for slow spheres in the paper; of other bodies the coefficient is what is measured.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.motion.rigid_body import cross_product


class MagnusLift(EffectModel):
    """Lift across spin and velocity."""

    entry = EFFECTS["magnus_lift"]
    lifts = True

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``C omega x v``."""
        del setting
        return theta * cross_product(moment.omega, moment.through_air)
