"""Where a flight is at one instant, how fast, and what both depend on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reached:
    """A flight of p parameters at one time, world frame.

    ``x`` (3,) m of the centre of mass, ``R`` (3, 3) world from body, ``velocity`` (6,) of v (m/s) and omega (rad/s); ``pose_J`` and
    ``velocity_J`` (6, p) by the flight's parameters, a turn as its left rotation vector.
    """

    x: Array
    R: Array
    velocity: Array
    pose_J: Array
    velocity_J: Array
