"""Drag of a sequence beside that which all share.

``dv/dt = g - rate u``, u the velocity against the air [Davies, J. Appl. Phys. 20 (1949) 821: drag grows with the spin]; no
torque. Valid while the spin stays.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame."""
    return np.asarray(-values["rate"] * state.through_air)
