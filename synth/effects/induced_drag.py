"""Drag that goes with lift, beside what a ball at rest about its centre has.

``dv/dt = g - ratio |l| u / |u|``, l the acceleration by lift, u the velocity through the air: lift and drag coefficients of a ball both
grow with S = r omega / u [Davies, J. Appl. Phys. 20 (1949) 821]; no torque.

Valid for balls at S up to about 1.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame; none without lift."""
    u = state.through_air
    speed = float(np.linalg.norm(u))
    if state.lift_world is None or speed == 0.0:
        return np.zeros(3)
    return np.asarray(-values["ratio"] * np.linalg.norm(state.lift_world) / speed * u)
