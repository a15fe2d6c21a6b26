"""Which effect explains the whole pattern of scores: hypotheses compared with one another.

Every effect changes the scores of all others in its own way. Under "effect E, and nothing else" the scores ``g`` of all candidates have
mean ``-H[:, E] theta`` and covariance ``M``; what the best theta leaves, ``min (g + H_E theta)ᵀ M⁻¹ (g + H_E theta)``, is chi-squared with
as many degrees of freedom as there are columns less those of E [Aitken 1936]. Hypotheses are ordered by that remainder plus a penalty
per parameter [Schwarz 1978]; those that leave nearly the same cannot be told apart by these data.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from estimator.diagnosis.score_tests import EfficientScores

Array = NDArray[np.float64]
SMALLEST_SHARE = 1e-3
"""Smallest eigenvalue of the scores' correlation matrix that is believed; aliased columns would otherwise be told apart by rounding."""


@dataclass(frozen=True)
class Hypothesis:
    """Effect number ``effect`` alone: its ``parameters``, what it leaves (``remainder``) and the criterion, remainder plus penalty."""

    effect: int
    parameters: int
    remainder: float
    criterion: float


@dataclass(frozen=True)
class Ranking:
    """All hypotheses by ascending criterion; ``nothing``: the remainder with no effect at all, ``columns`` its degrees of freedom."""

    hypotheses: tuple[Hypothesis, ...]
    nothing: float
    columns: int

    @property
    def p_nothing(self) -> float:
        """Probability of scores as large as these where nothing is missing."""
        return float(chi2.sf(self.nothing, max(self.columns, 1)))


def rank(scores: EfficientScores, *, penalty: float) -> Ranking:
    """Order the effects that have columns in ``scores``; ``penalty`` per parameter."""
    if not len(scores.columns):
        return Ranking((), 0.0, 0)
    whitener = _whitener(scores.M)
    y = whitener @ scores.g
    found = []
    for effect in sorted({c.effect for c in scores.columns}):
        rows = [i for i, c in enumerate(scores.columns) if c.effect == effect]
        X = whitener @ scores.H[:, rows]
        theta, *_ = np.linalg.lstsq(X, y, rcond=1e-10)
        left = float(np.sum((y - X @ theta) ** 2))
        found.append(Hypothesis(effect, len(rows), left, left + penalty * len(rows)))
    return Ranking(tuple(sorted(found, key=lambda h: h.criterion)), float(y @ y), len(y))


def _whitener(M: Array) -> Array:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(M), 1e-300))
    value, vector = np.linalg.eigh(M * scale[:, None] * scale)
    return np.asarray((vector / np.sqrt(np.maximum(value, SMALLEST_SHARE))).T * scale)
