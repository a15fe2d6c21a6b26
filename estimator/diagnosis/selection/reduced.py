"""A linearised campaign with the values that every sequence has for itself integrated out.

An effect with a value in every sequence has many columns. Under its prior they are eliminated (Schur's complement), and sets are compared
in the few shared columns that are left. Where sequences share nothing else, each sequence's columns are turned once to the principal axes
of their information; under any prior variance of a sequence they then are independent numbers, and no matrix is inverted.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.linalg.lapack import dpotrf, dpotrs

Array = NDArray[np.float64]
Index = NDArray[np.int64]
BLOCKS = 1e-9
"""Share of a column's information that it may have with another sequence's for both to count as independent: rounding."""


@dataclass(frozen=True)
class Quadratic:
    """``S(theta) = misfit - 2 pullᵀ theta + thetaᵀ information theta`` (c columns), and half the log determinant left on the way."""

    information: Array
    pull: Array
    misfit: float
    half_log_det: float = 0.0

    def take(self, rows: Index) -> "Quadratic":
        """The columns ``rows``, with zero for all others."""
        return Quadratic(self.information[rows[:, None], rows], self.pull[rows], self.misfit, self.half_log_det)


@dataclass(frozen=True)
class Posterior:
    """Amplitudes under their prior.

    ``mean`` (q,), ``covariance`` (q, q) for noise of variance one, ``misfit`` that the set leaves, prior included, and half the log
    determinant of information over prior.
    """

    mean: Array
    covariance: Array
    misfit: float
    half_log_det: float


def posterior(of: Quadratic, sigma: Array) -> Posterior:
    """The posterior of all columns (q,) under a normal prior of standard deviations ``sigma`` (q,)."""
    covariance, half = _under_prior(of.information, sigma)
    mean = covariance @ of.pull
    return Posterior(mean, covariance, of.misfit - float(of.pull @ mean), of.half_log_det + half)


def _under_prior(information: Array, sigma: Array) -> tuple[Array, float]:
    """``(information + diag(sigma⁻²))⁻¹`` (q, q), and half the log determinant of that information over the prior's."""
    one = np.eye(len(sigma))
    if not len(sigma):
        return one, 0.0
    L, failed = dpotrf(one + sigma[:, None] * information * sigma, lower=1)
    if failed:
        raise np.linalg.LinAlgError("expected information that is positive")
    return sigma[:, None] * dpotrs(L, one, lower=1)[0] * sigma, float(np.log(np.diag(L)).sum())


@dataclass(frozen=True)
class Own:
    """Columns that sequences have for themselves, in units of their limits, and the few others beside them, ready for elimination.

    ``owner`` (m,): the sequence of each; ``axes`` (m, m): the columns' values of one unit of each; ``information``: (m,) where the units
    are independent, else (m, m); ``pull`` (m,) and ``cross`` (m, k) with the ``few`` columns.
    """

    owner: Index
    axes: Array
    information: Array
    pull: Array
    cross: Array
    few: Quadratic

    @classmethod
    def of(cls, whole: Quadratic, rows: tuple[Index, ...], limits: Array) -> "Own":
        """Take the columns ``rows`` [sequence] (q,) out of a quadratic, with all of its columns as the few; ``limits`` (m,)."""
        index, owner = np.concatenate(rows), np.repeat(np.arange(len(rows)), [len(r) for r in rows])
        apart = independent(whole.information, rows)
        G = limits[:, None] * whole.information[np.ix_(index, index)] * limits
        told = [np.linalg.eigh(G[np.ix_(owner == s, owner == s)]) for s in range(len(rows))] if apart else []
        axes = limits[:, None] * (block_diag(*(vector for _, vector in told)) if apart else np.eye(len(index)))
        information = np.maximum(np.concatenate([value for value, _ in told]), 0.0) if apart else G
        return cls(owner, axes, information, axes.T @ whole.pull[index], axes.T @ whole.information[index], whole)

    def beside(self, few: Index) -> "Own":
        """The same beside ``few`` of the other columns."""
        return Own(self.owner, self.axes, self.information, self.pull, self.cross[:, few], self.few.take(few))

    def sums(self, each: Array) -> Array:
        """Sums (s,) over every sequence's own."""
        return np.asarray(np.bincount(self.owner, each), dtype=np.float64)

    def eliminated(self, variance: Array) -> tuple[Quadratic, Array, Array, Array]:
        """Integrated out under prior variances (s,) of the sequences' units.

        The quadratic of the few columns; then of the units the means (m,) at zero few, how they follow the few (m, k), and variances.
        """
        prior = variance[self.owner]
        if self.information.ndim == 1:
            ratio = 1.0 + prior * self.information
            spread, half = prior / ratio, 0.5 * float(np.log(ratio).sum())
            mean, follow = spread * self.pull, spread[:, None] * self.cross
        else:
            covariance, half = _under_prior(self.information, np.sqrt(prior))
            spread, mean, follow = np.diag(covariance), covariance @ self.pull, covariance @ self.cross
        few = self.few
        information, misfit = few.information - self.cross.T @ follow, few.misfit - float(self.pull @ mean)
        return Quadratic(information, few.pull - self.cross.T @ mean, misfit, few.half_log_det + half), mean, follow, spread


def independent(information: Array, rows: tuple[Index, ...]) -> bool:
    """Whether columns of different sequences share no information."""
    index = np.concatenate(rows)
    sequence = np.repeat(np.arange(len(rows)), [len(r) for r in rows])
    G = information[np.ix_(index, index)]
    scale = np.sqrt(np.maximum(np.diag(G), 1e-300))
    between = np.abs(G) / np.outer(scale, scale) * (sequence[:, None] != sequence)
    return bool(between.max(initial=0.0) < BLOCKS)
