"""Lift of flights whose spin nobody read, though that of others was: ``dv/dt = g + w x v``, another w in every one of them.

Not an effect that is asked for but an unknown of such flights, always in the model, with a prior as wide as the lifts of all flights are.
Flights whose spin was read have beside it what the reading is wrong by (:mod:`estimator.effects.catalogue.dynamics.unmeasured_lift`), which
is smaller by far: under one prior either would be as wide as the other. Valid while the spin keeps its axis and size.
"""

from dataclasses import replace

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.motion.rigid_body import cross_product


class UnreadLift(EffectModel):
    """Lift of its own in every sequence whose reading of the spin is set aside; ``sigma``: standard deviation (1/s) of its components."""

    instrument = True
    lifts = True
    of_unmeasured_spin = True

    def __init__(self, sigma: float) -> None:
        like = EFFECTS["unmeasured_lift"]
        self.held: tuple[float, ...] = (sigma,) * len(like.parameters)
        self.entry = replace(like, key="unread_lift")

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``w x v``."""
        return cross_product(theta, moment.v) if setting.misread else None
