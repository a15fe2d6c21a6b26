"""A gyroscope that does not read zero at rest.

``reading = omega + b`` [IEEE Std 952-1997, annex B]. Valid where the temperature is steady.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values


def read(omega_tracked: NDArray[np.float64], values: Values) -> NDArray[np.float64]:
    """Readings (n, 3) rad/s of angular velocities (n, 3) along the gyroscope's axes."""
    return omega_tracked + np.array([values["b_x"], values["b_y"], values["b_z"]])
