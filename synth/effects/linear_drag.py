"""Drag of slow flow.

``dv/dt = g - rate v`` [Stokes, Trans. Camb. Phil. Soc. 9 (1851) 8]; holds for Re < 1, still air, no torque.

Valid for Re < 1.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame."""
    return np.asarray(-values["rate"] * state.through_air)
