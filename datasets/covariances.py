"""What a matrix must be to be a covariance."""

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError

SYMMETRY = 1e-6
"""Largest difference of a covariance from its transpose, over the standard deviations of both: what rounding to six digits leaves."""


def check_covariance(matrix: NDArray[np.float64], where: str) -> None:
    """Refuse a matrix (n, n) that is no covariance: symmetric, finite, no negative variance along any direction.

    Raises
    ------
    InputError
        Naming ``where``, what was expected and what came.
    """
    deviations = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    with np.errstate(over="ignore", invalid="ignore"):
        alike = np.all(np.abs(matrix - matrix.T) <= SYMMETRY * np.outer(deviations, deviations))
    if not (np.isfinite(matrix).all() and alike and np.all(np.diag(matrix) >= 0) and _semidefinite(matrix, deviations)):
        raise InputError(f"{where}: expected a covariance (symmetric, no negative variance along any direction), got another matrix.")


def _semidefinite(matrix: NDArray[np.float64], deviations: NDArray[np.float64]) -> bool:
    """Whether no combination of the numbers has a negative variance; a number that does not vary may not vary with others."""
    varied = deviations > 0.0
    if np.any(matrix[~varied]) or np.any(matrix[:, ~varied]):
        return False
    correlation = matrix[np.ix_(varied, varied)] / deviations[varied] / deviations[varied, None]
    return bool(np.linalg.eigvalsh(correlation).min(initial=0.0) >= -SYMMETRY * len(matrix))
