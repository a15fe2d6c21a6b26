"""Lift of a ball that grows less than its spin.

``dv/dt = g + coefficient (omega x u) / (1 + length |omega| / |u|)``, u the velocity through the air [Nathan, Am. J. Phys. 76 (2008) 119:
C_L = S / (0.4 + 2.32 S) with S = r omega / u, hence length = 5.8 r]; does no work in still air; no torque.

Valid for balls at S up to about 1.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame."""
    u, omega = state.through_air, state.omega_world
    speed = float(np.linalg.norm(u))
    if speed == 0.0:
        return np.zeros(3)
    return np.asarray(values["coefficient"] * speed / (speed + values["length"] * float(np.linalg.norm(omega))) * np.cross(omega, u))
