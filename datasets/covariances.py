"""What a matrix must be to be a covariance."""

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError

SYMMETRY = 1e-6
"""Largest difference of a covariance from its transpose, over the standard deviations of both: what rounding to six digits leaves."""


def check_covariance(matrix: NDArray[np.float64], where: str) -> None:
    """Refuse a matrix (n, n) that is no covariance: symmetric, finite, no negative variance.

    Raises
    ------
    InputError
        Naming ``where``, what was expected and what came.
    """
    deviations = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    with np.errstate(over="ignore", invalid="ignore"):
        alike = np.all(np.abs(matrix - matrix.T) <= SYMMETRY * np.outer(deviations, deviations))
    if not (np.isfinite(matrix).all() and alike and np.all(np.diag(matrix) >= 0)):
        raise InputError(f"{where}: expected a covariance (symmetric, no negative variance), got another matrix.")
