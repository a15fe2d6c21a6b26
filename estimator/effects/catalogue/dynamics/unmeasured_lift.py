"""Lift of a spin that nobody measured, or of what a measured one is wrong by: ``dv/dt = g + w x v``, another w in every sequence.

``w = C (omega_true - omega_measured)``, C the coefficient of lift [Rubinow and Keller 1961]. A spin that is read once, off marks on a ball,
has now and then a wrong axis or sign; the flight tells. Along the flight w does nothing. Valid while the spin keeps its axis and size.

Drag grows with the spin, too [Davies 1949; Nathan 2008]. So what a reading is wrong by, which is noise, is a lift and a drag,
``w x v - d v``; of d four tenths of w are plausible, by judgement.

Wind is not in it: ``w x wind`` is one more steady acceleration of every flight. A wind that acted through values of every flight's own
would carry them into sets that do not have them: linearised, its three numbers would explain what each flight has of its own.
"""

from dataclasses import replace
from typing import Self

import numpy as np

from datasets.vocabulary.effects import EFFECTS, Parameter
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.motion.rigid_body import cross_product

DRAG = Parameter("d", "1/s", (-2.0, 2.0), 1e-3, "drag of what a measured spin is wrong by, over the velocity")


class UnmeasuredLift(EffectModel):
    """Lift of its own in every sequence; as noise of spins that were read, their drag, too."""

    entry = EFFECTS["unmeasured_lift"]
    of_unmeasured_spin = True

    def as_noise(self, freedom: float) -> Self:
        """With a drag of its own in every sequence."""
        return super().as_noise(freedom)._changed(entry=replace(self.entry, parameters=(*self.entry.parameters, DRAG)))

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``w x v``, less ``d v`` where d is a parameter."""
        del setting
        lift = cross_product(theta[:, :3], moment.v)
        return lift if theta.shape[1] == 3 else np.asarray(lift - theta[:, 3:] * moment.v)
