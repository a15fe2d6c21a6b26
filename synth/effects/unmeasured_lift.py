"""Lift of a spin that is not in the measurement, in a sequence.

``dv/dt = g + w x u``, u the velocity against the air [Rubinow and Keller 1961]. Valid while the spin stays.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame."""
    return np.asarray(np.cross([values["w_x"], values["w_y"], values["w_z"]], state.through_air))
