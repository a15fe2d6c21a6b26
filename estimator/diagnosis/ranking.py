"""Scores made independent, and what an effect leaves of them.

Every effect changes the scores of all others in its own way. Under "effect E, and nothing else" the scores ``g`` of all candidates have
mean ``-H[:, E] theta`` and covariance ``M``; what the best theta leaves, ``min (g + H_E theta)ᵀ M⁻¹ (g + H_E theta)``, is chi-squared with
as many degrees of freedom as there are columns less those of E [Aitken 1936].
"""

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.score_tests import EfficientScores

Array = NDArray[np.float64]
SMALLEST_SHARE = 1e-3
"""Smallest eigenvalue of the scores' correlation matrix that is believed; aliased columns would otherwise be told apart by rounding."""


def whitener(M: Array) -> Array:
    """The map (c, c) that makes scores of covariance ``M`` independent and of size one."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(M), 1e-300))
    value, vector = np.linalg.eigh(M * scale[:, None] * scale)
    return np.asarray((vector / np.sqrt(np.maximum(value, SMALLEST_SHARE))).T * scale)


def remainders(scores: EfficientScores) -> dict[int, float]:
    """What each effect that has columns leaves of all scores, by its number."""
    white = whitener(scores.M)
    y = white @ scores.g
    found = {}
    for effect in sorted({c.effect for c in scores.columns}):
        X = white @ scores.H[:, [i for i, c in enumerate(scores.columns) if c.effect == effect]]
        theta, *_ = np.linalg.lstsq(X, y, rcond=1e-10)
        found[effect] = float(np.sum((y - X @ theta) ** 2))
    return found
