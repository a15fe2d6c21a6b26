"""A linearised campaign with the values that every sequence has for itself integrated out.

An effect with a value in every sequence has many columns. Under its prior they are eliminated once for each scale of the prior (Schur's
complement), and sets of the few shared columns are compared in what is left.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Quadratic:
    """``S(theta) = misfit - 2 pullᵀ theta + thetaᵀ information theta`` (c columns), and half the log determinant left on the way."""

    information: Array
    pull: Array
    misfit: float
    half_log_det: float = 0.0


def without(whole: Quadratic, rows: NDArray[np.int64], sigma: Array) -> Quadratic:
    """The quadratic with the columns ``rows`` (q,) integrated out under a normal prior of standard deviations ``sigma`` (q,).

    All other columns keep their numbers; those of ``rows`` are empty.
    """
    G, b = whole.information, whole.pull
    K = np.eye(len(rows)) + sigma[:, None] * G[np.ix_(rows, rows)] * sigma
    factor = cho_factor(K, lower=True)
    cross = sigma[:, None] * G[rows]
    solved = cho_solve(factor, np.column_stack([cross, sigma * b[rows]]))
    information, pull = G - cross.T @ solved[:, :-1], b - cross.T @ solved[:, -1]
    information[rows], information[:, rows], pull[rows] = 0.0, 0.0, 0.0
    misfit = whole.misfit - float((sigma * b[rows]) @ solved[:, -1])
    return Quadratic(information, pull, misfit, whole.half_log_det + float(np.log(np.diag(factor[0])).sum()))


@dataclass(frozen=True)
class Posterior:
    """Amplitudes under their prior: ``mean`` (q,), ``covariance`` (q, q) for noise of variance one, the ``misfit`` that the set leaves,
    prior included, and half the log determinant of information over prior."""

    mean: Array
    covariance: Array
    misfit: float
    half_log_det: float


def posterior(of: Quadratic, rows: NDArray[np.int64], sigma: Array) -> Posterior:
    """The posterior of the columns ``rows`` (q,) under a normal prior of standard deviations ``sigma`` (q,)."""
    G, b = of.information[np.ix_(rows, rows)], of.pull[rows]
    L = np.linalg.cholesky(np.eye(len(rows)) + sigma[:, None] * G * sigma)
    inverse = cho_solve((L, True), np.eye(len(rows))) if len(rows) else np.zeros((0, 0))
    covariance = sigma[:, None] * inverse * sigma
    mean = covariance @ b
    return Posterior(mean, covariance, of.misfit - float(b @ mean), of.half_log_det + float(np.log(np.diag(L)).sum()))
