"""Viscous torque.

``dL/dt = -rate L`` [Lamb, Hydrodynamics (1932), art. 334, for a sphere, ``rate = 8 pi mu r³ / I``]: the angular momentum keeps its
direction and halves every ``ln 2 / rate``. No force.

Valid for slow flow.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values

Array = NDArray[np.float64]


def acceleration(_state: FlightState, _values: Values) -> Array:
    """No force."""
    return np.zeros(3)


def torque_body(state: FlightState, values: Values) -> Array:
    """Torque over the largest principal moment (3,) rad/s², body frame."""
    return np.asarray(-values["rate"] * state.ratios * state.omega_body)
