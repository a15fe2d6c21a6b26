"""By how much the wrong one of two effects is expected to lose.

Under "effect A has the size theta, and nothing else is missing" the efficient scores of all candidates have the mean ``-H_A theta`` and the
covariance ``M`` (:mod:`estimator.diagnosis.ranking`). What effect B leaves of that when it does its best, with all parameters of the
base model re-adjusted, is the noncentrality

    lambda = min over t of |L (H_A theta - H_B t)|²,   Lᵀ L = M⁻¹.

The criterion of B minus that of A, by which effects are told apart, is ``yᵀ Q y + penalty (k_B - k_A)`` with y = L g and Q = P_A - P_B, the
difference of the projections on what each can do; its mean is ``lambda + (penalty - 1) (k_B - k_A)`` and its variance ``2 tr Q² +
4 |Q E y|²``. H and M need no data, only where tangencies lie.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from estimator.diagnosis.ranking import whitener
from estimator.diagnosis.score_tests import EfficientScores, ScoreTest

Array = NDArray[np.float64]
SURE = 0.95
"""Probability with which a pair must be told apart for data to count as telling it apart."""


@dataclass(frozen=True)
class Expected:
    """Of the criterion by which the wrong effect loses: expected ``difference``, and ``probability`` that it exceeds the margin."""

    difference: float
    probability: float

    @property
    def separates(self) -> bool:
        """Whether the pair would be told apart."""
        return self.probability >= SURE


def expected(scores: EfficientScores, pair: tuple[int, int], tests: tuple[ScoreTest, ScoreTest], rule: tuple[float, float]) -> Expected:
    """What to expect of a pair, whichever of the two is true: the worse case.

    ``pair``: the effects' numbers in ``scores``, which need no ``g``; ``tests``: theirs, with their sizes; ``rule``: penalty per parameter
    and margin.
    """
    penalty, margin = rule
    white = whitener(scores.M)
    found = []
    for true, rival, test in ((*pair, tests[0]), (*pair[::-1], tests[1])):
        mean, deviation = moments(scores, white, (true, rival), sizes_in(scores, true, test), penalty)
        found.append(Expected(mean, float(norm.sf((margin - mean) / max(deviation, 1e-12)))))
    return min(found, key=lambda e: e.probability)


def sizes_in(scores: EfficientScores, effect: int, test: ScoreTest) -> Array:
    """The values of a test at the columns that ``effect`` has in ``scores``; zero in sequences that the test did not know."""
    sizes = {(c.parameter, c.sequence): float(v) for c, v in zip(test.columns, test.theta[: len(test.columns)], strict=True)}
    return np.array([sizes.get((c.parameter, c.sequence), 0.0) for c in scores.columns if c.effect == effect])


def moments(scores: EfficientScores, white: Array, pair: tuple[int, int], theta: Array, penalty: float) -> tuple[float, float]:
    """Mean and standard deviation of the rival's criterion minus that of the effect that is true and has the size ``theta``."""
    signature = white @ scores.H
    true, rival = (np.array([i for i, c in enumerate(scores.columns) if c.effect == e], dtype=np.int64) for e in pair)
    y = signature[:, true] @ theta
    Q = _projection(signature[:, true]) - _projection(signature[:, rival])
    mean = float(y @ Q @ y) + (penalty - 1.0) * (len(rival) - len(true))
    return mean, float(np.sqrt(2.0 * np.sum(Q**2) + 4.0 * np.sum((Q @ y) ** 2)))


def _projection(X: Array) -> Array:
    """Projection (c, c) on the columns of X (c, k)."""
    U, s, _ = np.linalg.svd(X, full_matrices=False)
    U = U[:, s > 1e-10 * max(float(s.max(initial=0.0)), 1e-300)]
    return np.asarray(U @ U.T)
