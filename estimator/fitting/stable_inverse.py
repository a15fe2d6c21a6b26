"""The inverse of a normal matrix in which some directions may not be seen at all."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


TOLERANCE = 1e-10
"""Eigenvalue, over the largest, below which a direction is not seen. Rounding leaves 3e-12 of what elimination takes away wholly: a centre
of mass along the axis of a ball's spin."""


def stable_inverse(H: Array, tolerance: float = TOLERANCE) -> Array:
    """Pseudo-inverse of a symmetric positive matrix after scaling its diagonal to one.

    Directions whose eigenvalue is below ``tolerance`` of the largest are left out: parameters the data do not see stay where they are.
    ``H`` (p, p).
    """
    diagonal = np.diag(H)
    scale = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0)
    value, vector = np.linalg.eigh(H * scale[:, None] * scale)
    kept = value > tolerance * max(float(value[-1]) if len(value) else 0.0, 1e-300)
    return np.asarray((vector[:, kept] / value[kept]) @ vector[:, kept].T * scale[:, None] * scale)
