"""Weights that count each outline's noise once: a composite likelihood with its magnitude adjusted, and the sandwich covariance it needs.

One silhouette's noise enters the pairs with all views, so for sighting ``i`` the errors in its picture have the covariance ``Σ_i =
sigma_i² K_i + D_i``: ``K_i`` the correlation of its own tangents, ``D_i`` the views' noise, magnified, and ``floor``². Each error is
weighted by ``1 / (Σ_jj d_i)`` with the design effect ``d_i = 1ᵀ R_i 1 / n``, R_i the correlation matrix [Kish 1965; Pauli, Racugno &
Ventura 2011 on composite likelihoods]: the sum of squares then has the size of a likelihood, so priors and known gravity get their proper
say.

The full inverse ``Σ_i⁻¹`` would be Aitken's optimum if the noise were what the model says. Measured on scanned bodies it is worse: it
leans on differences between neighbouring tangents, where hulls of noisy outlines differ in kind from hulls of bodies, and gave a scale
bias of 0.1-0.8% where these weights give 0.01-0.1%. It only serves for the bound, the inverse of :func:`information`.

With ``W = weight J`` the gradient's covariance is ``M = sum_i W_iᵀ Σ_i W_i + sum_k W_kᵀ (C_k - diag C_k) W_k`` over the views k (one view's
noise enters all sightings) plus the body-fixed part (:mod:`estimator.likelihood.body_fixed_error`); the parameters' is ``H⁻¹ (s² M + Λ)
H⁻¹`` [White 1982; Cameron, Gelbach & Miller 2011 for multi-way sums], Λ the prior's information and s² the mean square of the standardised
errors where it is above 1.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.silhouettes import Silhouettes
from estimator.likelihood.body_fixed_error import BodyPlaces, correlation
from estimator.likelihood.correlated_sums import AlongOutlines
from estimator.likelihood.noise_model import normal_angle, tangent_correlation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SightingsNoise:
    """Noise of the errors of n sightings with k views, from which covariances of their sums are made where they are asked for.

    ``told`` (n, k, 2) which there are; ``own`` (n, k, 2) px standard deviation of the outline's own noise, ``rest`` (n, k, 2) px² variance
    of all other; ``angle`` (n, k, 2) rad of the tangents' normals and ``correlation_rad`` (n,) the turn over which they are alike;
    ``along`` (n, k, 2) px what one standard deviation of a random effect moves, if there is one.
    """

    told: NDArray[np.bool_]
    own: Array
    rest: Array
    angle: Array
    correlation_rad: Array
    along: Array | None = None

    def spread(self, along: Array) -> Array:
        """Covariance (c, c) of ``sum alongᵀ e`` for weights ``along`` (n, k, 2, c)."""
        weights = along.reshape(self.told.size, along.shape[-1])
        total = _of_sightings(self.told, self.angle, self.own, self.own**2 + self.rest, self.correlation_rad).covariance(weights)
        if self.along is not None:
            moved = np.einsum("nks,nksc->nc", np.where(self.told, self.along, 0.0), along, optimize=True)
            total += moved.T @ moved
        return total


@dataclass(frozen=True)
class WeighedFrames:
    """Weighed errors of every sighting in terms of the parameters.

    ``H`` (p, p) and ``g`` (p,) of the data alone; ``weighted`` (n, k, 2, p) is ``W`` for each view and tangency, zero where there is no
    error, and ``weight`` (n, k, 2) px⁻² the weights themselves; ``noise`` of the sightings, if it is not in ``known`` (p, p), what else,
    like a prior, adds to the gradient's covariance; ``chi2`` (n,), the sum of squares of the standardised errors, and ``count`` (n,) of
    these, per sighting.
    """

    H: Array
    g: Array
    weighted: Array
    weight: Array
    noise: SightingsNoise | None
    known: Array
    chi2: Array
    count: NDArray[np.int64]

    @cached_property
    def meat(self) -> Array:
        """The gradient's covariance (p, p) within sightings."""
        return self.known + self.spread(self.weighted)

    def noisier(self, more: float) -> Array:
        """The gradient's covariance (p, p) where the sightings' noise is ``more`` times what its model says."""
        return self.known + more * (self.meat - self.known)

    def combined(self, change: Array, more: float = 1.0) -> "Combined":
        """In combinations ``change`` (p, c) of the parameters; ``more``: the sightings' noise over what its model says."""
        return Combined(self, change, more)

    def spread(self, along: Array) -> Array:
        """Covariance (c, c) of ``along`` (n, k, 2, c), transposed, times the sightings' noise."""
        return np.zeros((along.shape[-1],) * 2) if self.noise is None else self.noise.spread(along)

    @property
    def mean_square(self) -> float:
        """Mean square of the standardised errors, 1 where the residuals are as large as the noise model says."""
        return float(self.chi2.sum() / max(int(self.count.sum()), 1))


@dataclass(frozen=True)
class Combined:
    """Weighed ``frames`` in combinations ``change`` (p, c) of the parameters, the sightings' noise ``more`` times what its model says.

    Weights are worked out where they are asked for: noise that is in the normal equations alone needs none.
    """

    frames: WeighedFrames
    change: Array
    more: float

    @cached_property
    def weighted(self) -> Array:
        """``W`` (n, k, 2, c) of the combinations."""
        *places, p = self.frames.weighted.shape
        return np.asarray((self.frames.weighted.reshape(-1, p) @ self.change).reshape(*places, -1))

    @property
    def meat(self) -> Array:
        """The gradient's covariance (c, c)."""
        known = self.change.T @ self.frames.known @ self.change
        return known if self.frames.noise is None else known + self.more * self.frames.spread(self.weighted)


Weighted = WeighedFrames | Combined


def linear_errors(errors: TangencyErrors, S: Array) -> tuple[Array, Array]:
    """Errors (n, k, 2) px in the sightings' pictures and derivatives (n, k, 2, p); ``S`` (n, 8, p) maps pair columns to parameters."""
    return errors.error[:, :, :2], errors.jacobian[:, :, :2] @ S[:, None]


def weigh(errors: TangencyErrors, S: Array, first: Silhouettes, *, floor_px: float, huber: float) -> WeighedFrames:
    """Weigh each sighting's errors; ``S`` (n, 8, p) maps pair columns to parameters, ``floor_px`` is noise the outlines do not show."""
    return weigh_linear(linear_errors(errors, S), errors, first, floor_px=floor_px, huber=huber)


@dataclass(frozen=True)
class RandomShift:
    """A random effect: each sighting's errors move by its ``direction`` (n, k, 2) times a number drawn from N(0, ``sigma``²)."""

    direction: Array
    sigma: float


def weigh_linear(
    linear: tuple[Array, Array],
    errors: TangencyErrors,
    first: Silhouettes,
    *,
    floor_px: float,
    huber: float,
    shift: RandomShift | None = None,
) -> WeighedFrames:
    """Weigh each sighting's errors, ``linear`` as in :func:`linear_errors`; ``floor_px`` is noise the outlines do not show.

    An error beyond ``huber`` standard deviations has its variance raised until its influence is that of one at ``huber``. A random
    ``shift`` is taken off before that is judged, and out of the weights (Woodbury's identity) [Laird and Ware 1982].
    ``linear``: errors (n, k, 2) px and derivatives (n, k, 2, p).
    """
    (e, J), p = linear, linear[1].shape[-1]
    told, own, total, angle = _own_noise(errors, first, floor_px)
    e = np.where(told, e, 0.0)
    if not np.isfinite(J).all():  # where nothing is told, that matters to nobody
        J = np.where(told[..., None], J, 0.0)
    along = None if shift is None or shift.sigma == 0.0 else np.where(told, shift.sigma * shift.direction, 0.0)
    variance = total if along is not None else total * np.maximum(np.abs(e) / np.sqrt(total) / huber, 1.0)
    weight = told / (variance * design_effects(own / np.sqrt(variance), angle, told, first.correlation_rad)[:, None, None])
    if along is not None:
        outlying = np.maximum(np.abs(_without(e, along, weight)) / np.sqrt(variance) / huber, 1.0)
        variance, weight = variance * outlying, weight / outlying
    W, H = J * weight[..., None], _normal_matrix(J.reshape(-1, p), weight.ravel())
    if along is not None:
        H -= _take_out(W, along, weight)
    g = W.reshape(-1, p).T @ e.ravel()
    chi2 = np.sum(np.where(told, e**2 / variance, 0.0), axis=(1, 2))
    noise = SightingsNoise(told, own, variance - own**2, angle, first.correlation_rad, along)
    return WeighedFrames(H, g, W, weight, noise, np.zeros((p, p)), chi2, np.count_nonzero(told, axis=(1, 2)))


def _normal_matrix(J: Array, weight: Array) -> Array:
    """``Jᵀ diag(weight) J`` (p, p) of derivatives (m, p), of which many may be zero throughout: those of what is searched for."""
    p, there = J.shape[1], np.flatnonzero(J.any(axis=0))
    root = (J if len(there) == p else J[:, there]) * np.sqrt(weight)[:, None]
    H = np.zeros((p, p))
    H[np.ix_(there, there)] = root.T @ root
    return H


def _without(e: Array, along: Array, weight: Array) -> Array:
    """Errors (n, k, 2) less what of each sighting's is most likely a random effect, one standard deviation of which is ``along``."""
    size = np.sum(weight * along * e, axis=(1, 2)) / (1.0 + np.sum(weight * along**2, axis=(1, 2)))
    return np.asarray(e - along * size[:, None, None])


def _take_out(W: Array, along: Array, weight: Array) -> Array:
    """Take a random effect out of weighted derivatives ``W`` (n, k, 2, p), in place; what that takes from their normal matrix (p, p)."""
    heavy = weight * along
    shared = np.zeros((len(W), W.shape[-1]))
    for i in range(len(W)):
        shared[i] = along[i].ravel() @ W[i].reshape(-1, W.shape[-1])
    gain = 1.0 / (1.0 + np.sum(heavy * along, axis=(1, 2)))
    for i in range(len(W)):
        W[i] -= (gain[i] * heavy[i])[..., None] * shared[i]
    lost = np.sqrt(gain)[:, None] * shared
    return np.asarray(lost.T @ lost)


def _own_noise(errors: TangencyErrors, first: Silhouettes, floor_px: float) -> tuple[NDArray[np.bool_], Array, Array, Array]:
    """Which errors (n, k, 2) there are in the sightings' pictures, the outline's own noise (px), all variance (px²), the normals' angle."""
    told = errors.told[:, :, :2]
    vertex = np.where(told, first.offsets[:-1, None, None] + errors.tangency[:, :, :2], 0)
    own = np.where(told, first.sigma_px[vertex], 0.0)
    total = np.where(told, errors.variance[:, :, :2], 1.0) + floor_px**2
    return told, own, total, normal_angle(errors.direction[:, :, :2])


def design_effects(share: Array, angle: Array, told: NDArray[np.bool_], correlation_rad: Array) -> Array:
    """Of n sightings, ``1ᵀ R 1 / m`` of the m errors that are ``told`` (n, k, 2), 1 where none is.

    ``share`` (n, k, 2): the outline's own noise over the standard deviation of the error, ``angle`` (n, k, 2) of its normal.
    ``correlation_rad`` (n,).
    """
    noise = _of_sightings(told, angle, share, np.zeros(share.shape), correlation_rad)
    alike = noise.half(np.ones((share.size, 1))).reshape(len(share), -1).sum(axis=1)
    return np.asarray(1.0 + 2.0 * alike / np.maximum(np.count_nonzero(told, axis=(1, 2)), 1))


def _of_sightings(told: NDArray[np.bool_], angle: Array, own: Array, variance: Array, correlation_rad: Array) -> AlongOutlines:
    """Noise along the outlines of n sightings; arrays (n, k, 2)."""
    outline = np.where(told, np.arange(len(told))[:, None, None], -1)
    return AlongOutlines(outline.ravel(), angle.ravel(), own.ravel(), variance.ravel(), correlation_rad)


@dataclass(frozen=True)
class Sighting:
    """The errors ``e`` (m,) of one sighting with the views ``view`` at the tangencies ``side``.

    ``J`` (m, p) by the parameters, ``Sigma`` (m, m) px² their covariance.
    ``view``, ``side`` (m,): numbers.
    """

    view: NDArray[np.int64]
    side: NDArray[np.int64]
    e: Array
    J: Array
    Sigma: Array


def sighting(
    linear: tuple[Array, Array], errors: TangencyErrors, first: Silhouettes, i: int | np.integer, *, floor_px: float, huber: float
) -> Sighting:
    """Errors of sighting ``i``, their derivatives and covariance; arguments as in :func:`weigh`.

    ``linear``: errors (n, k, 2) px and derivatives (n, k, 2, p).
    """
    view, side = np.argwhere(errors.told_in(i)[:, :2]).T
    e, J = linear[0][i, view, side], linear[1][i, view, side]
    own = first.sigma_px[first.offsets[i] + errors.tangency[i, view, side]]
    K = tangent_correlation(errors.direction[i, view, side], float(first.correlation_rad[i]))
    total = errors.variance[i, view, side] + floor_px**2
    z = np.abs(e) / np.sqrt(total)
    D = total - own**2 + total * np.maximum(z / huber - 1.0, 0.0)
    return Sighting(view, side, e, J, own[:, None] * own[None, :] * K + np.diag(D))


def shared_view_noise(errors: TangencyErrors, weighted: Array, second: Silhouettes) -> Array:
    """What one view's outline noise adds to the gradient's covariance (p, p) by entering many sightings: the sum over the views above.

    ``weighted`` (n, k, 2, p) derivatives.
    """
    return noise_of_views(errors, second).covariance(weighted.reshape(-1, weighted.shape[-1]))


def noise_of_views(errors: TangencyErrors, second: Silhouettes) -> AlongOutlines:
    """That noise along the outlines of the views, in the errors (n k 2,) of all pairs."""
    n, k = errors.valid.shape
    seen = np.repeat(errors.valid[:, :, None], 2, axis=2)
    vertex = np.where(seen, second.offsets[:-1, None] + errors.tangency[:, :, 2:], 0)
    magnified = second.sigma_px[vertex] * errors.jacobian[:, :, :2, 7]
    outline = np.where(seen, np.arange(k)[:, None], -1)
    angle, own = normal_angle(errors.direction[:, :, 2:]).ravel(), magnified.ravel()
    return AlongOutlines(outline.ravel(), angle, own, np.zeros(n * k * 2), second.correlation_rad)


def information(errors: TangencyErrors, S: Array, first: Silhouettes, body: tuple[BodyPlaces, float], *, huber: float) -> Array:
    """Fisher information (p, p) of the errors under the noise model: own noise ``Σ_i`` and a body-fixed error.

    ``body``: places of the errors and the body-fixed error's standard deviation (px). With ``B_i`` the errors' cells the body-fixed error
    is a nuisance of covariance ``C = L Lᵀ``, eliminated as ``F - U L (1 + Lᵀ V L)⁻¹ Lᵀ Uᵀ``, F = Σ JᵀΣ_i⁻¹J, U = Σ JᵀΣ_i⁻¹B_i,
    V = Σ B_iᵀΣ_i⁻¹B_i.
    ``S`` (n, 8, p).
    """
    places, sigma_px = body
    linear, p = linear_errors(errors, S), S.shape[2]
    present, cells = np.unique(places.cell, return_inverse=True)
    cells = cells.reshape(places.normal.shape)
    total = np.zeros((p + len(present), p + len(present)))
    for i in errors.telling:
        seen = sighting(linear, errors, first, i, floor_px=0.0, huber=huber)
        here, column = np.unique(cells[i, seen.view, seen.side], return_inverse=True)
        X = np.hstack([seen.J, np.eye(len(here))[column]])
        rows = np.concatenate([np.arange(p), p + here])
        total[np.ix_(rows, rows)] += X.T @ cho_solve(cho_factor(seen.Sigma, lower=True), X)
    L = sigma_px * np.linalg.cholesky(correlation(present, places.grid) + 1e-6 * np.eye(len(present)))
    UL = total[:p, p:] @ L
    known = cho_solve(cho_factor(np.eye(len(present)) + L.T @ total[p:, p:] @ L, lower=True), UL.T)
    return np.asarray(total[:p, :p] - UL @ known)
