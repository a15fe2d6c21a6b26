"""Nearly evenly spread directions."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def fibonacci_sphere(count: int) -> Array:
    """``count`` nearly evenly spread unit vectors (count, 3) [González 2010]."""
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    azimuth = np.pi * (1.0 + np.sqrt(5.0)) * i
    r = np.sqrt(1.0 - z * z)
    return np.column_stack([r * np.cos(azimuth), r * np.sin(azimuth), z])
