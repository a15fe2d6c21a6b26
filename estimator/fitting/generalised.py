"""Generalised least squares: the trajectory fit with each sighting's errors weighted by the inverse of their full covariance.

Weighting errors as if they were independent counts one outline's noise once per view. The inverse covariance counts it once, gives
the priors and the known gravity their proper say, and brings the error near the Cramér-Rao-type bound [Aitken 1935]. The covariance is taken at a
nearby solution and held while one Gauss-Newton problem is solved; then it is refreshed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from estimator.fitting.noise_model import own_noise, views_noise
from estimator.geometry.epipolar_tangency import N_COLUMNS, TangencyErrors
from estimator.geometry.silhouettes import Silhouettes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrameEquations:
    """Per-sighting normal matrices ``normal`` (n, 8, 8), ``gradient`` (n, 8), ``chi2`` (n,) and number of errors ``count`` (n,).

    ``own`` and ``other`` hold what the covariance needs: for each sighting the gradient's response (sample, 8) to its own outline's unit noises,
    and ``(places, weighted columns)`` for the views'.
    """

    normal: Array
    gradient: Array
    chi2: Array
    count: NDArray[np.int64]
    own: tuple[Array, ...]
    other: tuple[tuple[NDArray[np.int64], Array], ...]


def frame_equations(errors: TangencyErrors, first: Silhouettes, second: Silhouettes, *, floor_px: float, huber: float) -> FrameEquations:
    """Whiten each sighting's errors with their covariance; ``floor_px`` is the part of it that the outlines' noise does not explain.

    Errors beyond ``huber`` standard deviations have their own variance raised until their influence is bounded.
    """
    n = len(errors.valid)
    normal, gradient = np.zeros((n, N_COLUMNS, N_COLUMNS)), np.zeros((n, N_COLUMNS))
    chi2, count = np.zeros(n), np.zeros(n, dtype=np.int64)
    own: list[Array] = []
    other: list[tuple[NDArray[np.int64], Array]] = []
    for i in range(n):
        if not errors.valid[i].any():
            own.append(np.zeros((0, N_COLUMNS)))
            other.append((np.zeros((0, 2), dtype=np.int64), np.zeros((0, N_COLUMNS))))
            continue
        Z, places = own_noise(errors, first, i)
        view, side = places.T
        e, J = errors.error[i, view, side], errors.jacobian[i, view, side]
        D = views_noise(errors, second, i, places, floor_px)
        z = np.abs(e) / np.sqrt(D + np.sum(Z**2, axis=1))
        D = D + np.where(z > huber, (z / huber - 1.0) * z / huber, 0.0) * (D + np.sum(Z**2, axis=1))
        factor = cho_factor(Z @ Z.T + np.diag(D), lower=True)
        weighted = cho_solve(factor, np.column_stack([J, e]))
        normal[i], gradient[i] = J.T @ weighted[:, :-1], J.T @ weighted[:, -1]
        chi2[i], count[i] = float(e @ weighted[:, -1]), len(e)
        own.append(Z.T @ weighted[:, :-1])
        other.append((places, weighted[:, :-1]))
    return FrameEquations(normal, gradient, chi2, count, tuple(own), tuple(other))
