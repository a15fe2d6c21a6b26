"""Drag beside that which all flights share, ``dv/dt = g - rate v``, another rate in every sequence.

Drag grows with the spin [Davies 1949; Nathan 2008], so where a spin was misread what the reading is wrong by is a drag, too; and of a drag
that grows with lift (:mod:`estimator.effects.catalogue.dynamics.induced_drag`), what is not lift's is left. Noise, beside spins that were
read once; in other measurements a drag of every flight's own would stand for anything that acts along it. Valid while the spin stays.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting


class UnmeasuredDrag(EffectModel):
    """Drag of its own in every sequence."""

    entry = EFFECTS["unmeasured_drag"]
    of_unmeasured_spin = True
    of_misread_spin = True

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``-rate v``."""
        del setting
        return np.asarray(-theta * moment.v)
