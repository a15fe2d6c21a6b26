"""A wobble that dies out.

``dL/dt = -rate I3 (omega - (omega . l) l)``, ``l = L / |L|``, ``I3`` the largest moment: dissipation within the body, or in the air about
a disc, takes energy and leaves the size of the angular momentum [Bracewell and Garriott, Nature 182 (1958) 760]. No force.

Valid for rates that are small against the spin.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values

Array = NDArray[np.float64]


def acceleration(_state: FlightState, _values: Values) -> Array:
    """No force."""
    return np.zeros(3)


def torque_body(state: FlightState, values: Values) -> Array:
    """Torque over the largest principal moment (3,) rad/s², body frame."""
    momentum = state.ratios * state.omega_body
    size = float(np.linalg.norm(momentum))
    if size == 0.0:
        return np.zeros(3)
    along = momentum / size
    return np.asarray(-values["rate"] * (state.omega_body - (state.omega_body @ along) * along))
