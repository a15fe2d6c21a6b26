"""How the noise of outlines enters the tangency errors: an explicit silhouette-noise model.

A tangent's distance from the middle of an outline, as a function of its direction θ, is the outline's support function; its noise is
taken as a stationary process with autocovariance ``sigma² exp(-|Δθ| / l)``, where ``l`` is the turn of the tangent over one smoothing
window. Drawn noise on scanned bodies gives this shape with l from 12° (smooth bodies) to 20° (angular ones). Different silhouettes are
independent. A model with the noise fixed to hull vertices is wrong in detail: it lets differences between tangents at one vertex count as
nearly noise-free, and biases the scale.

The size of the noise and ``l`` are read off the residuals of a first fit, since both depend on the body (a corner holds its tangent over
a wide angle).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.silhouettes import Silhouettes

Array = NDArray[np.float64]


def tangent_correlation(directions: Array, correlation_rad: float) -> Array:
    """Correlation (e, e) of the noise of tangents with outward normals ``directions`` (e, 2) of one silhouette."""
    return angle_correlation(normal_angle(directions), correlation_rad)


def normal_angle(directions: Array) -> Array:
    """Angle (...,) rad of ``directions`` (..., 2)."""
    return np.asarray(np.arctan2(directions[..., 1], directions[..., 0]))


def angle_correlation(angle: Array, correlation_rad: float) -> Array:
    """Correlation (e, e) of the noise of tangents whose normals have an ``angle`` (e,)."""
    apart = np.abs(angle[:, None] - angle[None, :])
    return np.asarray(np.exp(-np.minimum(apart, 2.0 * np.pi - apart) / correlation_rad))


LAGS_RAD = np.radians([2.0, 5.0, 8.0, 11.0, 14.0, 18.0, 22.0])
"""Edges of the bins of turns at which correlation is measured."""
SHORTEST_RAD, LONGEST_RAD = np.radians(3.0), np.radians(30.0)
"""Within which the correlation length is believed: not shorter than smoothing, nor longer than a corner. By judgement."""


@dataclass(frozen=True)
class MeasuredNoise:
    """Residuals' mean square over their expected variance, and the turn over which they are correlated.

    ``scale`` has far residuals clipped, as the fit sees them; ``mean_square`` has all of them.
    """

    scale: float
    mean_square: float
    correlation_rad: float


def measured_noise(errors: TangencyErrors) -> MeasuredNoise:
    """Size and correlation of the errors within each sighting's picture, as a first fit left them."""
    square, everything, counted = 0.0, 0.0, 0
    product, pairs = np.zeros(len(LAGS_RAD) - 1), np.zeros(len(LAGS_RAD) - 1)
    for i in errors.telling:
        told = errors.told_in(i)[:, :2]
        z = (errors.error[i, :, :2] / np.sqrt(errors.variance[i, :, :2]))[told]
        everything += float(z @ z)
        z = np.clip(z, -4.0, 4.0)
        u = errors.direction[i, :, :2][told]
        apart = np.arccos(np.clip(u @ u.T, -1.0, 1.0))
        bins = np.digitize(apart, LAGS_RAD) - 1
        inside = (bins >= 0) & (bins < len(product))
        product += np.bincount(bins[inside], (z[:, None] * z)[inside], minlength=len(product))
        pairs += np.bincount(bins[inside], minlength=len(product))
        square, counted = square + float(z @ z), counted + len(z)
    scale = square / max(counted, 1)
    r = product / np.maximum(pairs, 1) / max(scale, 1e-12)
    middle = 0.5 * (LAGS_RAD[1:] + LAGS_RAD[:-1])
    seen = (pairs > 0) & (r > 0.05)
    # Least squares of ln r = -lag / l through the origin.
    decay = -np.sum(middle[seen] * np.log(np.minimum(r[seen], 0.999)))
    length = float(np.clip(np.sum(middle[seen] ** 2) / decay if seen.any() else 0.0, SHORTEST_RAD, LONGEST_RAD))
    return MeasuredNoise(scale=scale, mean_square=everything / max(counted, 1), correlation_rad=length)


def with_noise(silhouettes: Silhouettes, noise: MeasuredNoise) -> Silhouettes:
    """The silhouettes with the measured size and correlation of their tangents' noise."""
    return replace(
        silhouettes,
        sigma_px=silhouettes.sigma_px * np.sqrt(noise.scale),
        correlation_rad=np.full(len(silhouettes), noise.correlation_rad),
    )
