"""A linearised campaign with the values that every sequence has for itself integrated out.

An effect with a value in every sequence has many columns. Under its prior they are eliminated (Schur's complement), and sets are compared
in the few shared columns that are left. Where sequences share nothing else, each sequence's columns are a block of their own.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrs
from scipy.special import log_ndtr

Array = NDArray[np.float64]
Index = NDArray[np.int64]
BLOCKS = 1e-9
"""Share of a column's information that it may have with another sequence's for both to count as independent: rounding."""


@dataclass(frozen=True)
class Quadratic:
    """``S(theta) = misfit - 2 pullᵀ theta + thetaᵀ information theta`` (c columns), and half the log determinant left on the way.

    ``information`` (c, c), ``pull`` (c,).
    """

    information: Array
    pull: Array
    misfit: float
    half_log_det: float = 0.0

    def take(self, rows: Index) -> "Quadratic":
        """The columns ``rows`` (k,), with zero for all others."""
        return Quadratic(self.information[rows[:, None], rows], self.pull[rows], self.misfit, self.half_log_det)


@dataclass(frozen=True)
class Posterior:
    """Amplitudes under their prior of standard deviations ``sigma`` (q,).

    ``mean`` (q,), ``factor`` (q, q) of the information in units of the prior's, ``misfit`` that the set leaves, prior included, and half
    the log determinant of information over prior.
    """

    mean: Array
    sigma: Array
    factor: Array
    misfit: float
    half_log_det: float

    @cached_property
    def covariance(self) -> Array:
        """Covariance (q, q) of the amplitudes for noise of variance one."""
        return self.sigma[:, None] * _solved(self.factor, np.eye(len(self.sigma))) * self.sigma


def posterior(of: Quadratic, sigma: Array) -> Posterior:
    """The posterior of all columns (q,) under a normal prior of standard deviations ``sigma`` (q,)."""
    factor: Array = np.linalg.cholesky(np.eye(len(sigma)) + sigma[:, None] * of.information * sigma).astype(np.float64, copy=False)
    mean = sigma * _solved(factor, sigma * of.pull)
    half = float(np.log(np.diagonal(factor)).sum())
    return Posterior(mean, sigma, factor, of.misfit - float(of.pull @ mean), of.half_log_det + half)


def _solved(factor: Array, of: Array) -> Array:
    """``(L Lᵀ)⁻¹ of`` with L the ``factor``."""
    return np.asarray(dpotrs(factor, of, lower=1)[0]).reshape(of.shape) if len(of) else of


def log_share_inside(bounds: Array, at: Posterior, noise: float) -> float:
    """Logarithm of a posterior's share that lies where amplitudes can be, over the prior's share where they have one sign only.

    ``bounds`` (3, q): the least and the largest, in the amplitudes' units, and whether they have one sign; ``noise``: its variance.
    """
    low, high, one_sided = bounds
    bounded = np.isfinite(low) & np.isfinite(high)
    if not bounded.any():
        return 0.0
    mean, sigma = at.mean[bounded], np.sqrt(noise * np.diag(at.covariance)[bounded])
    share = _log_share((low[bounded] - mean) / sigma, (high[bounded] - mean) / sigma)
    return float(np.sum(share + np.log(2.0) * one_sided[bounded]))


def _log_share(low: Array, high: Array) -> Array:
    """Logarithm of the standard normal distribution's share between two bounds (n,)."""
    low, high = np.where(low > 0.0, -high, low), np.where(low > 0.0, -low, high)
    above, below = log_ndtr(high), log_ndtr(low)
    return np.asarray(above + np.log1p(-np.exp(np.minimum(below - above, -1e-12))))


@dataclass(frozen=True)
class Own:
    """Columns that sequences have for themselves, in units of their limits, and the few others beside them, ready for elimination.

    ``rows`` (m,): their numbers; ``group`` (m,): values under one prior, those of one effect in one sequence; ``blocks`` (b + 1,): the
    first unit of each block that shares no information with others, and the end; ``limits`` (m,); ``information`` (m, m); ``pull`` (m,) and
    ``cross`` (m, k) with the ``few`` columns.
    """

    rows: Index
    group: Index
    blocks: Index
    limits: Array
    information: Array
    pull: Array
    cross: Array
    few: Quadratic

    @classmethod
    def of(cls, whole: Quadratic, groups: tuple[Index, ...], sequence: Index, limits: Array) -> "Own":
        """Take the columns ``groups`` [group] (q,) out of a quadratic, with all of its columns as the few.

        ``sequence`` (g,) of each group, growing; ``limits`` (c,) of all columns.
        """
        rows, sizes = np.concatenate(groups), np.array([len(group) for group in groups])
        apart = independent(whole.information, groups, sequence)
        starts = np.flatnonzero(np.diff(np.repeat(sequence, sizes))) + 1 if apart else np.zeros(0, dtype=np.int64)
        blocks, limit = np.concatenate([[0], starts, [len(rows)]]), limits[rows]
        cross = limit[:, None] * whole.information[rows]
        return cls(
            rows, np.repeat(np.arange(len(groups)), sizes), blocks, limit, cross[:, rows] * limit, limit * whole.pull[rows], cross, whole
        )

    def beside(self, few: Index) -> "Own":
        """The same beside ``few`` of the other columns; ``few`` (k,): their numbers."""
        return replace(self, cross=np.ascontiguousarray(self.cross[:, few]), few=self.few.take(few))

    def sums(self, each: Array) -> Array:
        """Sums (g,) over every group; ``each`` (m,): a number of every unit."""
        return np.asarray(np.bincount(self.group, each), dtype=np.float64)


def independent(information: Array, groups: tuple[Index, ...], sequence: Index) -> bool:
    """Whether columns of different sequences share no information.

    ``information`` (c, c); ``groups`` [group] (q,): columns; ``sequence`` (g,) of each group.
    """
    index = np.concatenate(groups)
    owner = np.repeat(sequence, [len(group) for group in groups])
    G = information[np.ix_(index, index)]
    scale = np.sqrt(np.maximum(np.diag(G), 1e-300))
    between = np.abs(G) / np.outer(scale, scale) * (owner[:, None] != owner)
    return bool(between.max(initial=0.0) < BLOCKS)
