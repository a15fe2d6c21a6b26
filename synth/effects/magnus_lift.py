"""Lift of a spinning body.

``dv/dt = g + coefficient (omega x v)`` [Rubinow and Keller, J. Fluid Mech. 11 (1961) 447, for a sphere at low Re, where the coefficient is
``pi rho_air r³ / m``]; does no work; no torque.

Valid at low Re; of other bodies the coefficient is given.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame."""
    return np.asarray(values["coefficient"] * np.cross(state.omega_world, state.through_air))
