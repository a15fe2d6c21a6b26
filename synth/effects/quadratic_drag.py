"""Drag of fast flow.

``dv/dt = g - per_length |v| v``, ``per_length = rho_air C_D A / (2 m)`` [Clift, Grace and Weber, Bubbles, Drops and Particles (1978), ch.
6]; holds for Re > 1000, still air, one drag coefficient for all orientations, no torque.

Valid for Re above about 1000.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame."""
    return np.asarray(-values["per_length"] * np.linalg.norm(state.through_air) * state.through_air)
