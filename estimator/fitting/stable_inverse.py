"""The inverse of a normal matrix in which some directions may not be seen at all."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def stable_inverse(H: Array, tolerance: float = 1e-12) -> Array:
    """Pseudo-inverse of a symmetric positive matrix after scaling its diagonal to one.

    Directions whose eigenvalue is below ``tolerance`` of the largest are left out: parameters the data do not see stay where they are.
    """
    diagonal = np.diag(H)
    scale = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0)
    value, vector = np.linalg.eigh(H * scale[:, None] * scale)
    kept = value > tolerance * max(float(value[-1]) if len(value) else 0.0, 1e-300)
    return np.asarray((vector[:, kept] / value[kept]) @ vector[:, kept].T * scale[:, None] * scale)
