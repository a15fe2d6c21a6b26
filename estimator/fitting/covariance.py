"""How sure a trajectory fit is: a covariance from an explicit silhouette-noise model, and the Cramér-Rao-type bound.

Residuals are not independent. One silhouette's noise enters the pairs with all views, one view's noise enters all frames; what is
independent is the noise along each *outline*, correlated over the smoothing window. With ``G_s`` (vertex, parameter) the sensitivity of the
gradient to the noise of silhouette ``s``'s hull vertices and ``C_s`` their covariance, the gradient's covariance is
``M = sum_frames G C Gᵀ + sum_views G C Gᵀ`` and the parameters' ``H⁻¹ (s² M + Λ) H⁻¹``: the sandwich form [White 1982; Cameron, Gelbach & Miller
2011 for the two-way sum], Λ the prior's information and s² the whitened mean square, which carries noise that the outlines do not show.

The bound is the inverse Fisher information of the same residuals under the same noise, frames' noise fully correlated within the frame:
``(sum_i J_iᵀ Σ_i⁻¹ J_i + Λ)⁻¹`` with ``Σ_i = A C_i Aᵀ + D``; no unbiased use of these tangencies can do better.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs

from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.silhouettes import Silhouettes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Uncertainty:
    """``covariance``, ``bound`` (p, p) and ``whitened_mean_square``, 1 where residuals are as large as expected."""

    covariance: Array
    bound: Array
    whitened_mean_square: float


def uncertainty(errors: TangencyErrors, S: Array, first: Silhouettes, second: Silhouettes, *, prior_precision: Array, H: Array) -> Uncertainty:
    """Covariance and bound of the parameters that the pair columns depend on through ``S`` (n, 8, p); ``H`` (p, p) is the fit's normal matrix."""
    J = errors.jacobian @ S[:, None]
    weight = np.where(errors.valid[:, :, None], 0.5 / errors.variance, 0.0)
    score = J * weight[..., None]
    meat = _scatter(score * errors.jacobian[..., 6:7], errors.tangency[..., :2], first, axis=0)
    meat = meat + _scatter(score * errors.jacobian[..., 7:8], errors.tangency[..., 2:], second, axis=1)
    mean_square = float(np.mean((errors.error**2 / errors.variance)[errors.valid]))
    prior = np.diag(prior_precision)
    scale = 1.0 / np.sqrt(np.diag(H))
    inverse = np.linalg.inv(H * scale[:, None] * scale) * scale[:, None] * scale
    covariance = inverse @ (mean_square * meat + prior) @ inverse
    information = _information(errors, J, first, mean_square) + prior
    return Uncertainty(covariance=_symmetric(covariance), bound=_symmetric(_inverse(information)), whitened_mean_square=mean_square)


def vertex_covariance(silhouettes: Silhouettes, index: int) -> Array:
    """Covariance (v, v) px² of the hull vertices of one silhouette along their normals: smoothed white noise along the outline."""
    rows = silhouettes.slice_of(index)
    arc, sigma = silhouettes.arc_px[rows], silhouettes.sigma_px[rows]
    perimeter = max(float(silhouettes.perimeter_px[index]), 1e-9)
    lag = np.abs(arc[:, None] - arc[None, :])
    lag = np.minimum(lag, perimeter - lag)
    window = float(silhouettes.correlation_px[index])
    return np.asarray(sigma[:, None] * sigma[None, :] * _autocorrelation(lag / window))


def _autocorrelation(lag: Array) -> Array:
    """Autocorrelation of smoothed white noise at lags in units of the smoothing window."""
    c = savgol_coeffs(101, 2)
    r = np.correlate(c, c, mode="full")[100:]
    return np.interp(lag, np.arange(101) / 101.0, r / r[0], right=0.0)


def _scatter(score: Array, tangency: NDArray[np.int32], silhouettes: Silhouettes, *, axis: int) -> Array:
    """``sum_s G_sᵀ C_s G_s`` over the silhouettes along ``axis`` of ``score`` (n, k, 4, p)."""
    p = score.shape[-1]
    both = score[:, :, :2] + score[:, :, 2:]
    total = np.zeros((p, p))
    for s in range(score.shape[axis]):
        rows = silhouettes.slice_of(s)
        G = np.zeros((rows.stop - rows.start, p))
        part, vertices = np.take(both, s, axis=axis), np.take(tangency, s, axis=axis)
        seen = vertices >= 0
        np.add.at(G, vertices[seen], part[seen])
        total += G.T @ vertex_covariance(silhouettes, s) @ G
    return total


def _information(errors: TangencyErrors, J: Array, first: Silhouettes, scale: float) -> Array:
    """Fisher information (p, p) of the first's errors, each frame's noise correlated along its outline, the views' taken as independent."""
    p = J.shape[-1]
    total = np.zeros((p, p))
    for i in range(len(errors.valid)):
        rows = first.slice_of(i)
        seen = np.repeat(errors.valid[i], 2)
        if not seen.any():
            continue
        vertices = errors.tangency[i, :, :2].reshape(-1)[seen]
        own = vertex_covariance(first, i)
        sigma2 = first.sigma_px[rows][vertices] ** 2
        views = errors.variance[i, :, :2].reshape(-1)[seen] - sigma2
        Sigma = scale * (own[np.ix_(vertices, vertices)] + np.diag(views))
        Ji = J[i, :, :2].reshape(-1, p)[seen]
        total += Ji.T @ np.linalg.solve(Sigma, Ji)
    return total


def _inverse(information: Array) -> Array:
    scale = 1.0 / np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information * scale[:, None] * scale) * scale[:, None] * scale)


def _symmetric(matrix: Array) -> Array:
    return np.asarray(0.5 * (matrix + matrix.T))
