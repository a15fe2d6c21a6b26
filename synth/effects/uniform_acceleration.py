"""A constant acceleration, another one in every sequence: a steady draught, a charge in a field, an accelerated camera.

``dv/dt = g + a``, world frame [Goldstein, Classical Mechanics (1980), ch. 4]. No torque.

Valid where it is steady during a sequence.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(_state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame."""
    return np.array([values["a_x"], values["a_y"], values["a_z"]])
