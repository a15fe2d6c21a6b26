"""A wobble that dies out.

``dL/dt = -rate I3 (omega - (omega . l) l)``, ``l = L / |L|``, ``I3`` the largest moment: air about a disc [Hummel, Frisbee Flight
Simulation (2003)], and to first order dissipation within the body [Bracewell and Garriott, Nature 182 (1958) 760], take energy and leave
the size of the angular momentum. No force.

Valid for rates that are small against the precession.
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
