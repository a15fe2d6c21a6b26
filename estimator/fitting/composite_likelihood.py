"""Weights that count each outline's noise once: a composite likelihood with its magnitude adjusted, and the sandwich covariance it needs.

One silhouette's noise enters the pairs with all views, so for sighting ``i`` the errors in its picture have the covariance ``Σ_i =
sigma_i² K_i + D_i``: ``K_i`` the correlation of its own tangents, ``D_i`` the views' noise, magnified, and ``floor``². Each error is
weighted by ``1 / (Σ_jj d_i)`` with the design effect ``d_i = 1ᵀ R_i 1 / n``, R_i the correlation matrix [Kish 1965; Pauli, Racugno &
Ventura 2011 on composite likelihoods]: the sum of squares then has the size of a likelihood, so priors and known gravity get their proper
say.

The full inverse ``Σ_i⁻¹`` would be Aitken's optimum if the noise were what the model says. Measured on scanned bodies it is worse: it
leans on differences between neighbouring tangents, where hulls of noisy outlines differ in kind from hulls of bodies, and gave a scale
bias of 0.1-0.8% where these weights give 0.01-0.1%. It only serves for the bound, the inverse Fisher information ``(sum J_iᵀ Σ_i⁻¹ J_i +
Λ)⁻¹``.

With ``W = weight J`` the gradient's covariance is ``M = sum_i W_iᵀ Σ_i W_i + sum_k W_kᵀ (C_k - diag C_k) W_k`` over the views k (one
view's noise enters all sightings) plus the body-fixed part of :func:`body_noise`; the parameters' is ``H⁻¹ (s² M + Λ) H⁻¹`` [White 1982;
Cameron, Gelbach & Miller 2011 for multi-way sums], Λ the prior's information and s² the mean square of the standardised errors where it
is above 1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from estimator.fitting.noise_model import tangent_correlation
from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.silhouettes import Silhouettes
from estimator.geometry.sphere import fibonacci_sphere

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WeighedFrames:
    """Weighed errors of every sighting in terms of the parameters.

    ``H`` (p, p) and ``g`` (p,) of the data alone; ``weighted`` (n, k, 2, p) is ``W`` for each view and tangency, zero where there is no
    error; ``meat`` (p, p) the gradient's covariance within sightings, ``fisher`` (p, p) the information under the full ``Σ``; ``chi2``
    (n,), the sum of squares of the standardised errors, and ``count`` (n,) per sighting.
    """

    H: Array
    g: Array
    weighted: Array
    meat: Array
    fisher: Array
    chi2: Array
    count: NDArray[np.int64]

    @property
    def mean_square(self) -> float:
        """Mean square of the standardised errors, 1 where the residuals are as large as the noise model says."""
        return float(self.chi2.sum() / max(int(self.count.sum()), 1))


def weigh(errors: TangencyErrors, S: Array, first: Silhouettes, *, floor_px: float, huber: float) -> WeighedFrames:
    """Weigh each sighting's errors; ``S`` (n, 8, p) maps pair columns to parameters, ``floor_px`` is noise the outlines do not show.

    An error beyond ``huber`` standard deviations has its variance raised until its influence is that of one at ``huber``.
    """
    n, k, p = errors.valid.shape[0], errors.valid.shape[1], S.shape[2]
    H, g = np.zeros((p, p)), np.zeros(p)
    meat, fisher = np.zeros((p, p)), np.zeros((p, p))
    weighted = np.zeros((n, k, 2, p))
    chi2, count = np.zeros(n), np.zeros(n, dtype=np.int64)
    for i in np.flatnonzero(errors.valid.any(axis=1)):
        view, side = np.argwhere(np.repeat(errors.valid[i][:, None], 2, axis=1)).T
        e, J = errors.error[i, view, side], errors.jacobian[i, view, side] @ S[i]
        own = first.sigma_px[first.offsets[i] + errors.tangency[i, view, side]]
        K = tangent_correlation(errors.direction[i, view, side], float(first.correlation_rad[i]))
        total = errors.variance[i, view, side] + floor_px**2
        z = np.abs(e) / np.sqrt(total)
        D = total - own**2 + total * np.maximum(z / huber - 1.0, 0.0)
        Sigma = own[:, None] * own[None, :] * K + np.diag(D)
        factor = cho_factor(Sigma, lower=True)
        solved = cho_solve(factor, np.column_stack([J, e]))
        variance = np.diag(Sigma)
        z1 = 1.0 / np.sqrt(variance)
        repeated = float(z1 @ Sigma @ z1) / len(e)
        W = J / (variance * repeated)[:, None]
        weighted[i, view, side] = W
        H += J.T @ W
        g += W.T @ e
        meat += W.T @ Sigma @ W
        fisher += J.T @ solved[:, :-1]
        chi2[i], count[i] = float(np.sum(e**2 / variance)), len(e)
    return WeighedFrames(H=H, g=g, weighted=weighted, meat=meat, fisher=fisher, chi2=chi2, count=count)


def shared_view_noise(errors: TangencyErrors, frames: WeighedFrames, second: Silhouettes) -> Array:
    """``sum_k W_kᵀ (C_k - diag C_k) W_k`` (p.

    P): what one view's outline noise adds to the gradient's covariance by entering many sightings.
    """
    p = frames.weighted.shape[-1]
    total = np.zeros((p, p))
    for k in range(errors.valid.shape[1]):
        sighting, side = np.argwhere(np.repeat(errors.valid[:, k][:, None], 2, axis=1)).T
        if len(sighting) == 0:
            continue
        sigma = second.sigma_px[second.offsets[k] + errors.tangency[sighting, k, 2 + side]]
        magnified = sigma * errors.jacobian[sighting, k, side, 7]
        K = tangent_correlation(errors.direction[sighting, k, 2 + side], float(second.correlation_rad[k]))
        np.fill_diagonal(K, 0.0)
        W = frames.weighted[sighting, k, side] * magnified[:, None]
        total += W.T @ K @ W
    return total


BODY_CELLS = 400


def body_noise(errors: TangencyErrors, frames: WeighedFrames, normals: Array, *, sigma_px: float) -> Array:
    """What a body-fixed error of ``sigma_px`` adds to the gradient's covariance (p, p).

    Tangencies at one place on the body share it in all sightings.

    ``normals`` (n, k, 2, 3): outward normals in body axes; places are cells of about 0.18 rad on the sphere of normals.
    """
    p = frames.weighted.shape[-1]
    seen = np.repeat(errors.valid[:, :, None], 2, axis=2)
    cells = fibonacci_sphere(BODY_CELLS)
    nearest = np.argmax(normals[seen] @ cells.T, axis=1)
    G = np.zeros((BODY_CELLS, p))
    np.add.at(G, nearest, frames.weighted[seen])
    return np.asarray(sigma_px**2 * G.T @ G)
