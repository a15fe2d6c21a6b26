"""How well noise is known whose size is read off residuals: the degrees of freedom of its variance, and what they are worth in intervals.

The logarithm of the variance along an axis in a sequence is the axis's, which all sequences share, plus the sequence's own, which all axes
share and whose prior is that of :mod:`estimator.likelihood.rows`. Residuals of ``n`` degrees of freedom tell it to a variance of ``2 / n``.
So it is known as the normal equations of these say, and a Student's t of as many degrees of freedom is what an estimate in units of such
noise is distributed as [O'Hagan and Forster 2004, ch. 11].
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from estimator.likelihood.rows import NOISE_FREEDOM

Array = NDArray[np.float64]
TAIL = 0.975
"""Upper quantile of a 95% interval: what interval is told, no unknown."""


def noise_freedom(freedom: Array, known: NDArray[np.bool_]) -> Array:
    """Degrees of freedom (s, a) by which the noise of sequences along axes is known.

    Parameters
    ----------
    freedom : (s, a) array
        Degrees of freedom of the residuals; zero where nothing was measured.
    known : (a,) array
        Whether the noise of an axis is stated.
    """
    sequences, axes = freedom.shape
    H = np.zeros((axes + sequences,) * 2)
    H[:axes, :axes] = np.diag(0.5 * freedom.sum(axis=0) + np.where(known, 1.0 / np.finfo(float).eps, np.finfo(float).eps))
    H[axes:, axes:] = np.diag(0.5 * freedom.sum(axis=1) + 0.5 * NOISE_FREEDOM)
    H[:axes, axes:], H[axes:, :axes] = 0.5 * freedom.T, 0.5 * freedom
    C = np.linalg.inv(H)
    variance = np.diag(C)[:axes] + np.diag(C)[axes:, None] + 2.0 * C[axes:, :axes]
    return np.asarray(2.0 / variance)


def as_students(freedom: Array) -> Array:
    """By how much larger a variance is whose normal 95% interval is that of Student's t of ``freedom`` (...)."""
    return np.where(np.isinf(freedom), 1.0, (stdtrit(freedom, TAIL) / ndtri(TAIL)) ** 2)
