"""A gyroscope whose sensitivities are off.

``reading_i = omega_i (1 + s_i)`` [IEEE Std 952-1997, annex B]. Valid below saturation.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values


def read(omega_tracked: NDArray[np.float64], values: Values) -> NDArray[np.float64]:
    """Readings (n, 3) rad/s of angular velocities (n, 3) along the gyroscope's axes."""
    return omega_tracked @ np.diag([1.0 + values["s_x"], 1.0 + values["s_y"], 1.0 + values["s_z"]])
