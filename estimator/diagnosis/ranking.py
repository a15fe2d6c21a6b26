"""Which effect explains the whole pattern of scores: hypotheses compared with one another.

Every effect changes the scores of all others in its own way. Under "effect E, and nothing else" the scores ``g`` of all candidates have
mean ``-H[:, E] theta`` and covariance ``M``; what the best theta leaves, ``min (g + H_E theta)ᵀ M⁻¹ (g + H_E theta)``, is chi-squared with
as many degrees of freedom as there are columns less those of E [Aitken 1936]. Hypotheses are ordered by that remainder plus a penalty
per parameter [Hannan and Quinn 1979]; those that leave nearly the same cannot be told apart by these data. Two effects together are a
hypothesis like one: where two are missing, a third that is neither may leave less than each alone.

A value that nature does not produce (negative drag), or hardly, counts against an effect, and an effect that is random in every frame is
compared by what it gains in likelihood, since it leaves no mean in the scores.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from estimator.diagnosis.score_tests import EfficientScores, ScoreTest
from estimator.effects.parameter_values import surprise

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


BEYOND = 2.0
"""Standard deviations around a value of which some has to lie in the plausible range, or its surprise is added to the criterion."""


def rank(scores: EfficientScores, tests: Sequence[ScoreTest], *, penalty: float) -> Ranking:
    """Order the effects; ``tests`` are theirs, in the order of their numbers in ``scores``; ``penalty`` per parameter."""
    plain = by_remainder(scores, penalty=penalty)
    rivals = max((t.explained - penalty * len(t.columns) for t in tests if not t.random), default=0.0)
    found = [replace(h, criterion=h.criterion + surprise_of(tests[h.effect], tests[h.effect].theta)) for h in plain.hypotheses]
    best = min((h.criterion for h in found), default=plain.nothing)
    for number, test in enumerate(tests):
        if test.random:
            lead = test.explained - penalty - rivals
            found.append(Hypothesis(number, 1, max(plain.nothing - test.explained, 0.0), best - lead))
    return replace(plain, hypotheses=tuple(sorted(found, key=lambda h: h.criterion)))


def surprise_of(test: ScoreTest, theta: Array) -> float:
    """The largest surprise at values (c,) of a test's columns, each within ``BEYOND`` standard deviations."""
    deviation = np.sqrt(np.maximum(np.diag(test.covariance), 0.0))[: len(test.columns)]
    found = [
        surprise((value - BEYOND * sigma, value + BEYOND * sigma), test.effect.entry.parameters[column.parameter])
        for column, value, sigma in zip(test.columns, theta[: len(test.columns)], deviation, strict=True)
    ]
    return max(found, default=0.0)


def by_remainder(scores: EfficientScores, *, penalty: float) -> Ranking:
    """Order the effects that have columns by what they leave alone.

    It is counted in units of :func:`misfit_unit`.
    """
    if not len(scores.columns):
        return Ranking((), 0.0, 0)
    white = whitener(scores.M)
    y = white @ scores.g
    found = []
    for effect in sorted({c.effect for c in scores.columns}):
        rows = [i for i, c in enumerate(scores.columns) if c.effect == effect]
        X = white @ scores.H[:, rows]
        theta, *_ = np.linalg.lstsq(X, y, rcond=1e-10)
        left = float(np.sum((y - X @ theta) ** 2))
        found.append(Hypothesis(effect, len(rows), left, np.inf))
    unit = misfit_unit((h.remainder, len(y) - h.parameters) for h in found)
    found = [replace(h, criterion=h.remainder / unit + penalty * h.parameters) for h in found]
    return Ranking(tuple(sorted(found, key=lambda h: h.criterion)), float(y @ y), len(y))


def misfit_unit(left: Iterable[tuple[float, int]]) -> float:
    """The unit in which misfits are compared, given what each hypothesis leaves (chi-squared, degrees of freedom).

    Where none leaves what chance would in 99% of cases, models are inexact, and the more so the larger an effect is: what they leave is
    then larger than a likelihood says by a factor, which the best of them shows [QAIC, Lebreton et al. 1992; Burnham and Anderson 2002,
    section 2.5].
    """
    return max(1.0, min((each / float(chi2.isf(0.01, max(degrees, 1))) for each, degrees in left), default=1.0))


@dataclass(frozen=True)
class Pair:
    """Two effects together, numbers ``effects``, with the same figures as a :class:`Hypothesis`."""

    effects: tuple[int, int]
    parameters: int
    remainder: float
    criterion: float


def pairs_by_remainder(scores: EfficientScores, *, penalty: float) -> tuple[Pair, ...]:
    """All pairs of effects that have columns, by what they leave together."""
    if not len(scores.columns):
        return ()
    white = whitener(scores.M)
    y = white @ scores.g
    number = np.array([c.effect for c in scores.columns])
    basis = {int(e): white @ scores.H[:, number == e] for e in np.unique(number)}
    found = []
    for pair in combinations(basis, 2):
        X = np.hstack([basis[e] for e in pair])
        theta, *_ = np.linalg.lstsq(X, y, rcond=1e-10)
        left = float(np.sum((y - X @ theta) ** 2))
        found.append(Pair(pair, X.shape[1], left, left + penalty * X.shape[1]))
    return tuple(sorted(found, key=lambda p: p.criterion))


def whitener(M: Array) -> Array:
    """The map (c, c) that makes scores of covariance ``M`` independent and of size one."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(M), 1e-300))
    value, vector = np.linalg.eigh(M * scale[:, None] * scale)
    return np.asarray((vector / np.sqrt(np.maximum(value, SMALLEST_SHARE))).T * scale)
