"""From a noisy outline to the convex hull of its tangency candidates, each with its expected noise.

The hull of a noisy contour lies outside the true one, since it is made of extremes. A periodic local quadratic fit along the contour
[Savitzky & Golay 1964] before the hull is taken removes part of that, and rounds corners. For samples a pixel apart with white noise of
0.2 px, a circle of 30 px radius comes out too large by 0.22 px unsmoothed, 0.11 px with the window of five samples used here and 0.04 px
with nine; the corner of a square is cut by 0.06 px with five and by 0.29 px with nine (tests/estimator/geometry/test_tangent_hull.py).
What remains is a nearly constant offset, which the fit carries as a parameter.

The smoothing's own residual gives the point noise: for white noise it has the variance ``(1 - 2 c_0 + sum c²) sigma²``,
where ``c`` are the filter's weights.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.linalg import lstsq
from scipy.ndimage import convolve1d
from scipy.spatial import ConvexHull

from estimator.geometry.closed_curves import resampled, unit_circle
from estimator.geometry.robust_scale import robust_sigma

Array = NDArray[np.float64]

SPACING_PX = 1.0
"""Outlines sampled more coarsely or unevenly than this are resampled."""
WINDOW = 5
"""Samples in the local quadratic fit."""
NOISE_FLOOR_PX = 0.03
"""No outline from pixels is known better than this."""
MINIMUM_POINTS = 12
"""Samples of an outline below which it is not smoothed and not used: twice the smoothing window. By judgement."""
CORRELATED_SHARE = 0.8
"""Correlation length of tangent noise in units of the smoothing window, measured on scanned bodies with drawn noise (0.6 to 1.2)."""


@dataclass(frozen=True)
class TangentHull:
    """Hull vertices ``points_px`` (v, 2) px in the outline's order and the noise of its tangents.

    ``sigma_px`` (v,) is the standard deviation of a tangent along its normal, ``correlation_rad`` the turn of the tangent over which that
    noise is correlated, ``noise_px`` the outline's point noise before smoothing, ``samples`` how many there are.
    """

    points_px: Array
    sigma_px: Array
    correlation_rad: float
    noise_px: float
    samples: int


@dataclass(frozen=True)
class Likeness:
    """The camera to be like.

    ``spacing_px`` of its samples and their ``noise_px``, both in px of the finer picture; ``draws``: how many outlines to draw;
    ``directions``: in how many directions to average them.
    """

    spacing_px: float
    noise_px: float
    draws: int = 32
    directions: int = 120


def tangent_hull(points_px: Float[NDArray[np.float64], "n 2"], *, window: int = WINDOW) -> TangentHull:
    """Smooth a closed outline (px) and take its convex hull; empty where the outline has no area."""
    if len(points_px) < 3:
        return _empty()
    samples = evenly_spaced(points_px)
    if len(samples) < MINIMUM_POINTS or np.ptp(samples, axis=0).min() < 1.0:
        return _empty()
    window = min(window, len(samples) // 4 * 2 + 1)
    smooth = _smooth(samples, window)
    normal = normals(smooth)
    noise = _point_noise(samples - smooth, normal, window)
    rows = np.sort(ConvexHull(smooth).vertices)
    return _with_noise(smooth[rows], noise, window, len(samples))


def degraded_hull(
    points_px: Float[NDArray[np.float64], "n 2"],
    likeness: Likeness,
    rng: np.random.Generator,
    shown: Callable[[Array, Array], Array] | None = None,
) -> TangentHull:
    """The hull that a coarser camera would have seen of this outline, on average over its noise.

    Hulls of noisy outlines are fat on flat stretches, smoothed ones are cut at corners. Comparing a coarse outline with a fine one makes
    both look like a change of size. Here the fine outline is sampled, made noisy and smoothed as the coarse one was, and the hulls of
    ``likeness.draws`` such outlines are averaged (the Minkowski mean: support functions add), so both sides carry the same bias.
    ``shown`` does this instead where it is known: from an outline in px of the coarse camera and directions (d, 2) to the mean's support
    points (d, 2).
    """
    if len(points_px) < 3:
        return _empty()
    fine = evenly_spaced(points_px)
    if len(fine) < MINIMUM_POINTS or np.ptp(fine, axis=0).min() < 1.0:
        return _empty()
    spacing = likeness.spacing_px
    window = min(_odd(WINDOW * max(1.0, spacing)), len(fine) // 4 * 2 + 1)
    smooth = _smooth(fine, window)
    normal = normals(smooth)
    noise = _point_noise(fine - smooth, normal, window)
    extra = np.sqrt(max(likeness.noise_px**2 - noise**2, 0.0))
    if shown is not None:
        mean = spacing * shown(fine / spacing, unit_circle(likeness.directions))
    else:
        mean = _mean_support_points(fine, spacing, extra, likeness, rng)
    return _with_noise(mean, noise, window, len(fine))


def smoothed(points_px: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], "m 2"]:
    """A closed outline (px) of :data:`MINIMUM_POINTS` samples at least, smoothed as its tangents are, with its hollows."""
    samples = evenly_spaced(points_px)
    return _smooth(samples, min(WINDOW, len(samples) // 4 * 2 + 1))


def _mean_support_points(fine: Array, spacing: float, extra_px: float, likeness: Likeness, rng: np.random.Generator) -> Array:
    """Support points (direction, 2) of the Minkowski mean of the degraded outlines' hulls."""
    outward = unit_circle(likeness.directions)
    count = max(MINIMUM_POINTS, round(len(fine) / max(spacing, 1.0)))
    phase = np.arange(likeness.draws)[:, None] / likeness.draws
    where = (np.arange(count) + phase) * (len(fine) / count)
    low = where.astype(np.int64)
    share = (where - low)[:, :, None]
    coarse = (1.0 - share) * fine[low % len(fine)] + share * fine[(low + 1) % len(fine)]
    noisy = coarse + normals(coarse) * (extra_px * rng.standard_normal((likeness.draws, count, 1)))
    smooth = _smooth(noisy, min(WINDOW, count // 4 * 2 + 1))
    reached = np.argmax(outward @ np.swapaxes(smooth, 1, 2), axis=2)
    return np.asarray(np.take_along_axis(smooth, reached[:, :, None], axis=1).sum(axis=0) / likeness.draws)


def _smooth(points: Array, window: int) -> Array:
    """Closed curves (..., n, 2) with the local quadratic fit in place of their points."""
    return np.asarray(convolve1d(points, smoothing_weights(window), axis=-2, mode="wrap"))


def _odd(x: float) -> int:
    return 2 * round((x - 1.0) / 2.0) + 1


def _with_noise(vertices: Array, noise: float, window: int, samples: int) -> TangentHull:
    """The hull whose tangents carry the smoothed noise.

    One window's share of the outline turns the tangent by as large a share of the circle.
    """
    sigma = np.hypot(noise * np.sqrt(np.sum(smoothing_weights(window) ** 2)), NOISE_FLOOR_PX)
    return TangentHull(
        points_px=vertices,
        sigma_px=np.full(len(vertices), sigma),
        correlation_rad=CORRELATED_SHARE * 2.0 * np.pi * window / samples,
        noise_px=noise,
        samples=samples,
    )


def _empty() -> TangentHull:
    return TangentHull(np.zeros((0, 2)), np.zeros(0), 1.0, 0.0, 0)


@cache
def smoothing_weights(window: int) -> Array:
    """Weights (window,) of the samples in the middle of a local quadratic fit; ``window`` is odd [Savitzky & Golay 1964]."""
    places = np.arange(window // 2, -(window // 2) - 1, -1.0)
    weights = np.asarray(lstsq(places ** np.arange(3.0)[:, None], np.array([1.0, 0.0, 0.0]))[0])
    weights.setflags(write=False)
    return weights


def evenly_spaced(points: Array) -> Array:
    """The outline itself where its samples are about evenly spaced near ``SPACING_PX``, otherwise resampled along its length.

    ``points`` (n, 2) px.
    """
    closed = np.concatenate([points, points[:1]])
    steps = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    typical = float(np.median(steps))
    uneven = float(np.percentile(steps, 95)) > 2.0 * typical
    if not uneven and 0.5 * SPACING_PX <= typical <= 1.5 * SPACING_PX:
        return points
    return resampled(points, SPACING_PX, fewest=3)


def normals(smooth: Array) -> Array:
    """Unit normals (..., n, 2) of closed curves, outwards for positive orientation; ``smooth`` (..., n, 2) px."""
    tangent = np.roll(smooth, -1, axis=-2) - np.roll(smooth, 1, axis=-2)
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1)
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12))


def _point_noise(residual: Array, normal: Array, window: int) -> float:
    """Robust standard deviation (px) of the samples along the outline's normal, from what the smoothing took off."""
    c = smoothing_weights(window)
    share = 1.0 - 2.0 * c[window // 2] + float(np.sum(c**2))
    along = np.sum(residual * normal, axis=1)
    return float(robust_sigma(along - np.median(along))) / np.sqrt(share)
