"""Lift of a spin that nobody measured, or of what a measured one is wrong by: ``dv/dt = g + w x v``, another w in every sequence.

``w = C (omega_true - omega_measured)``, C the coefficient of lift [Rubinow and Keller 1961]. A spin that is read once, off marks on a ball,
has now and then a wrong axis or sign; the flight tells. Along the flight w does nothing. Valid while the spin keeps its axis and size.

Wind is not in it: ``w x wind`` is one more steady acceleration of every flight. A wind that acted through values of every flight's own
would carry them into sets that do not have them: linearised, its three numbers would explain what each flight has of its own.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.motion.rigid_body import cross_product


class UnmeasuredLift(EffectModel):
    """Lift of its own in every sequence."""

    entry = EFFECTS["unmeasured_lift"]
    lifts = True
    of_unmeasured_spin = True

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``w x v``; nothing beside a reading that is set aside, where it is :mod:`estimator.effects.instrument.unread_lift`."""
        return None if setting.misread else cross_product(theta, moment.v)
