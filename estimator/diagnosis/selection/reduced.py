"""A linearised campaign with the values that every sequence has for itself integrated out.

An effect with a value in every sequence has many columns. Under its prior they are eliminated (Schur's complement), and sets are compared
in the few shared columns that are left. Where sequences share nothing else, their columns are independent blocks, and all are eliminated at
once.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

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


def posterior(of: Quadratic, rows: Index, sigma: Array) -> Posterior:
    """The posterior of the columns ``rows`` (q,) under a normal prior of standard deviations ``sigma`` (q,)."""
    G, b = of.information[np.ix_(rows, rows)], of.pull[rows]
    L = np.linalg.cholesky(np.eye(len(rows)) + sigma[:, None] * G * sigma)
    inverse = cho_solve((L, True), np.eye(len(rows))) if len(rows) else np.zeros((0, 0))
    covariance = sigma[:, None] * inverse * sigma
    mean = covariance @ b
    return Posterior(mean, covariance, of.misfit - float(b @ mean), of.half_log_det + float(np.log(np.diag(L)).sum()))


@dataclass(frozen=True)
class Own:
    """Columns that sequences have for themselves, and the few others beside them, ready for elimination.

    ``rows`` [sequence] (q,), fewer where a sequence does not show all; ``few`` (k,) the columns that stay; ``blocks`` (s, q, q), ``cross``
    (s, q, k) and ``pull`` (s, q) where sequences are independent blocks, else ``None``.
    """

    whole: Quadratic
    rows: tuple[Index, ...]
    few: Index
    blocks: Array | None
    cross: Array | None
    pull: Array | None

    @property
    def there(self) -> NDArray[np.bool_]:
        """Which of the q columns each sequence has (s, q)."""
        most = max(len(r) for r in self.rows)
        return np.array([np.arange(most) < len(r) for r in self.rows])

    @classmethod
    def of(cls, whole: Quadratic, rows: tuple[Index, ...], few: Index) -> "Own":
        """Take the columns out of a quadratic."""
        if len({len(r) for r in rows}) > 1 or not independent(whole.information, rows):
            return cls(whole, rows, few, None, None, None)
        index = np.array(rows)
        blocks = whole.information[index[:, :, None], index[:, None, :]]
        return cls(whole, rows, few, blocks, whole.information[index[:, :, None], few[None, None, :]], whole.pull[index])

    def eliminated(self, sigma: Array) -> tuple[Quadratic, Array, Array, Array]:
        """Integrated out under standard deviations ``sigma`` (s, q).

        The quadratic of the few columns; then the means (s, q) at zero few, how they follow the few (s, q, k), and variances (s, q).
        """
        if self.blocks is None or self.cross is None or self.pull is None:
            return self._at_once(sigma)
        K = np.eye(sigma.shape[1]) + sigma[:, :, None] * self.blocks * sigma[:, None, :]
        inverse = sigma[:, :, None] * np.linalg.inv(K) * sigma[:, None, :]
        mean, follow = np.einsum("sij,sj->si", inverse, self.pull), inverse @ self.cross
        information = self.whole.information[np.ix_(self.few, self.few)] - np.einsum("sik,sil->kl", self.cross, follow)
        pull = self.whole.pull[self.few] - np.einsum("sik,si->k", self.cross, mean)
        half = 0.5 * float(np.linalg.slogdet(K)[1].sum())
        left = Quadratic(information, pull, self.whole.misfit - float(np.sum(self.pull * mean)), self.whole.half_log_det + half)
        return left, mean, follow, np.einsum("sii->si", inverse)

    def _at_once(self, sigma: Array) -> tuple[Quadratic, Array, Array, Array]:
        """The same where sequences hang together."""
        there = self.there
        rows, D = np.concatenate(self.rows), sigma[there]
        G, C, b = self.whole.information[np.ix_(rows, rows)], self.whole.information[np.ix_(rows, self.few)], self.whole.pull[rows]
        factor = cho_factor(np.eye(len(D)) + D[:, None] * G * D, lower=True)
        inverse = D[:, None] * cho_solve(factor, np.diag(D))
        mean, follow = inverse @ b, inverse @ C
        information = self.whole.information[np.ix_(self.few, self.few)] - C.T @ follow
        half = float(np.log(np.diag(factor[0])).sum())
        left = Quadratic(information, self.whole.pull[self.few] - C.T @ mean, self.whole.misfit - float(b @ mean), half)
        means, follows, variances = np.zeros(sigma.shape), np.zeros((*sigma.shape, len(self.few))), np.zeros(sigma.shape)
        means[there], follows[there], variances[there] = mean, follow, np.diag(inverse)
        return left, means, follows, variances


def independent(information: Array, rows: tuple[Index, ...]) -> bool:
    """Whether columns of different sequences share no information."""
    index = np.concatenate(rows)
    sequence = np.repeat(np.arange(len(rows)), [len(r) for r in rows])
    G = information[np.ix_(index, index)]
    scale = np.sqrt(np.maximum(np.diag(G), 1e-300))
    between = np.abs(G) / np.outer(scale, scale) * (sequence[:, None] != sequence)
    return bool(between.max(initial=0.0) < BLOCKS)
