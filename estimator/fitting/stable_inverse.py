"""The inverse of a normal matrix in which some directions may not be seen at all."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


TOLERANCE = 1e-10
"""Eigenvalue, over the largest, below which a direction is not seen. Rounding leaves 3e-12 of what elimination takes away wholly: a centre
of mass along the axis of a ball's spin."""


def stable_inverse(H: Array, tolerance: float = TOLERANCE) -> Array:
    """Pseudo-inverses (..., p, p) of symmetric positive matrices after scaling their diagonals to one.

    Directions whose eigenvalue is below ``tolerance`` of the largest are left out: parameters the data do not see stay where they are.
    ``H`` (p, p).
    """
    diagonal = np.diagonal(H, axis1=-2, axis2=-1)
    scale = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0)
    value, vector = np.linalg.eigh(H * scale[..., :, None] * scale[..., None, :])
    kept = value > tolerance * np.maximum(value[..., -1:], 1e-300)
    inverse = np.where(kept, 1.0 / np.where(kept, value, 1.0), 0.0)
    return np.asarray((vector * inverse[..., None, :]) @ np.swapaxes(vector, -1, -2) * scale[..., :, None] * scale[..., None, :])
