"""A spin that is read wrongly in a sequence, in its axis, its sign or its size.

``read = omega + |read| e`` [Fuller 1987, ch. 1]. Valid for one reading, or for an error that all readings of a sequence share.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values


def read(omega_world: NDArray[np.float64], size_rads: float, values: Values) -> NDArray[np.float64]:
    """What is read (n, 3) rad/s of spins (n, 3), world frame; ``size_rads`` of what is read."""
    return omega_world + size_rads * np.array([values["e_x"], values["e_y"], values["e_z"]])
