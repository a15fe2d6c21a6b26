"""Torque against a wobble, ``dL/dt = -b I3 (omega - (omega . l) l)``, l the direction of L: air about a disc, or an energy sink.

The size of L stays, the energy falls until the body spins about the axis of its largest moment. To first order in the wobble and in the
rate over that of the precession, so do air that damps a disc's pitch and roll [Hummel 2003] and dissipation within a body [Bracewell and
Garriott 1958]. ``I3`` is the largest moment as stated. Valid for rates that are small against the precession.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Moment, Setting


class NutationDamping(EffectModel):
    """Torque along the part of the spin that lies across the angular momentum."""

    entry = EFFECTS["nutation_damping"]

    def torque(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """``-b (omega - (omega . L) L / L²)``."""
        del setting
        omega, L = moment.omega, moment.L
        share = np.sum(omega * L, axis=1, keepdims=True) / np.maximum(np.sum(L**2, axis=1, keepdims=True), np.finfo(np.float64).tiny)
        return np.asarray(-theta * (omega - share * L))
