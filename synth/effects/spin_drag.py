"""Drag that grows with the spin, beside what a ball at rest about its centre has.

``dv/dt = g - coefficient |omega| u``, u the velocity through the air: a drag coefficient that grows with S = r omega / u [Davies, J. Appl.
Phys. 20 (1949) 821]; no torque.

Valid for balls at S up to about 1.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame."""
    return np.asarray(-values["coefficient"] * np.linalg.norm(state.omega_world) * state.through_air)
