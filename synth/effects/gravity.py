"""Gravity is not what the observation states: the camera is tilted, or the place another one.

``dv/dt = g_stated + dg``, world frame, the same in all sequences. Valid where gravity is uniform.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(_state: FlightState, values: Values) -> NDArray[np.float64]:
    """What is added to the stated gravity (3,) m/s², world frame."""
    return np.array([values["dg_x"], values["dg_y"], values["dg_z"]])
