"""A vent fixed to the body blows steadily. The catalogue does not know it.

``dv/dt = g + R_world_body a``; a vent at ``arm`` from the centre of mass also turns the body by the torque ``m arm x a``, body frame
[Marsden, Sekanina and Yeomans, Astron. J. 78 (1973) 211]. The loss of mass is neglected.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import FlightState, Values

Array = NDArray[np.float64]


def acceleration(state: FlightState, values: Values) -> Array:
    """Acceleration (3,) m/s², world frame."""
    return np.asarray(state.R_world_body @ _thrust(values))


def torque_body(state: FlightState, values: Values) -> Array:
    """Torque over the largest principal moment (3,) rad/s², body frame."""
    arm = np.array([values["arm1"], values["arm2"], values["arm3"]])
    return np.asarray(state.mass_over_moment * np.cross(arm, _thrust(values)))


def _thrust(values: Values) -> Array:
    return np.array([values["a1"], values["a2"], values["a3"]])
