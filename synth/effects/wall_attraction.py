"""Attraction towards a plane wall, falling with the square of the distance. The catalogue does not know it.

``dv/dt = g - strength n / (n . x - position)²``, ``n`` the unit normal into the room [image charge before a conducting wall; Israelachvili,
Intermolecular and Surface Forces (2011), ch. 13]. Acts on the centre of mass; valid on the room's side, well away from the wall.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from synth.effects.links import FlightState, Values


def acceleration(state: FlightState, values: Values) -> NDArray[np.float64]:
    """Acceleration (3,) m/s², world frame.

    Raises
    ------
    InputError
        Where the normal has no direction, or the particle is not on the room's side of the wall.
    """
    normal = np.array([values["normal_x"], values["normal_y"], values["normal_z"]])
    length = float(np.linalg.norm(normal))
    if length == 0:
        raise InputError("wall_attraction: expected a normal of some length, got (0, 0, 0).")
    distance = float(normal @ state.x_world) / length - values["position"]
    if distance <= 0:
        raise InputError(
            f"wall_attraction: expected a flight on the room's side of the wall, got one that is {-distance:.3g} m behind it at "
            f"{state.time_s:.4g} s."
        )
    return np.asarray(-values["strength"] * normal / length / distance**2)
