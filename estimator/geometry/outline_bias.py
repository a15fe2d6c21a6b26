"""How far noise and smoothing move an outline's tangents on average, predicted from the outline that the body casts.

The hull of a noisy outline is fat where the outline is flat, since it is made of extremes, and the smoothed one is cut at corners: the bias
of a tangent follows the outline's curvature in its own view. With the outline ``P`` known (from the calibrated views, at a fitted
pose), noise of a known size and the smoothing of :mod:`estimator.geometry.tangent_hull`,

    b(u) = E[ support of the hull of the smoothed noisy P, along u ] - support of P along u,

as a mean over drawn outlines. Draws come in pairs of opposite noise, so what is linear in the noise cancels. What ``P`` does not show,
hollows that it bridges and roughness, makes the true bias smaller: the prediction is put on a level and slope measured on the same body.

Valid for noise that is white along the outline. Blur is not described: it cuts corners beyond what the smoothing does.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numba
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.silhouettes import Silhouettes
from estimator.geometry.support import support
from estimator.geometry.tangent_hull import MINIMUM_POINTS, WINDOW, smoothing_weights

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
DIRECTIONS = 180
"""Directions, every two degrees, at which biases are tabled; read linearly between."""
SMALLEST_POLYGON = 3
"""Corners below which an outline has no area."""
WEIGHTS = smoothing_weights(WINDOW)
"""Of the samples in the middle value of the local quadratic fit, as measured outlines are smoothed [Savitzky and Golay 1964]."""


@dataclass(frozen=True)
class Calibration:
    """A sighting's bias (px) is ``level + slope`` times the prediction."""

    level: float
    slope: float


@dataclass(frozen=True)
class DrawnBias:
    """Bias ``curves`` (k, 180) px of outlines' tangents, and the digest ``of`` the drawn noise that they are the mean over."""

    curves: Float[NDArray[np.float64], "k 180"]
    of: str


@dataclass(frozen=True)
class OutlineBias:
    """Predicted bias (px, outwards) of n sightings' tangents, ``own`` (n, 180), and of k views', ``view`` (k, 180).

    By the direction of the outward normal in the picture, from the first axis on in equal steps. ``calibration``: what the views' own bias
    says of predictions for sightings; it has been applied.
    """

    own: Float[NDArray[np.float64], "n 180"]
    view: Float[NDArray[np.float64], "k 180"]
    calibration: Calibration = Calibration(0.0, 1.0)

    def take(self, rows: Rows) -> "OutlineBias":
        """That of the sightings ``rows`` alone."""
        return replace(self, own=self.own[rows])

    def with_views(self, errors: TangencyErrors) -> Float[NDArray[np.float64], "n k 2"]:
        """What it adds to the errors (px) in the pictures of sightings paired with views."""
        return _pair_bias(self.own, self.view, errors)

    def within(self, errors: TangencyErrors) -> Float[NDArray[np.float64], "n n 2"]:
        """What it adds to the errors (px) in the first's pictures of sightings paired with one another."""
        return _pair_bias(self.own, self.own, errors)


def _pair_bias(first: Array, second: Array, errors: TangencyErrors) -> Array:
    own = curve_at(first, np.arange(len(first))[:, None, None], errors.direction[:, :, :2])
    other = curve_at(second, np.arange(len(second))[None, :, None], errors.direction[:, :, 2:])
    return np.where(errors.valid[:, :, None], own + errors.jacobian[:, :, :2, 7] * other, 0.0)


def without_bias(errors: TangencyErrors, bias: OutlineBias | None) -> TangencyErrors:
    """The errors in the sightings' pictures less their predicted bias; nothing else is changed, their whitened sums included."""
    if bias is None:
        return errors
    error = errors.error.copy()
    error[:, :, :2] -= bias.with_views(errors)
    return replace(errors, error=error)


def bias_curves(
    polygons: Sequence[Array], noise_px: float, samples: Rows, *, pairs: int, rng: np.random.Generator
) -> Float[NDArray[np.float64], "n 180"]:
    """Bias (px) of the tangents of outlines ``polygons``, each (v, 2) px, seen with point noise ``noise_px``.

    ``samples`` (n,): how many points each outline was seen with, zero where there is none; ``pairs`` of draws for each.
    """
    return bias_under(polygons, drawn_noise(polygons, noise_px, samples, pairs=pairs, rng=rng))


def noise_streams(rng: np.random.Generator) -> tuple[np.random.Generator, np.random.Generator]:
    """Where the noise of views and that of sightings is drawn from."""
    for_views, for_sightings = rng.spawn(2)
    return for_views, for_sightings


def drawn_noise(polygons: Sequence[Array], noise_px: float, samples: Rows, *, pairs: int, rng: np.random.Generator) -> list[Array]:
    """Noise (pairs, samples) px of the points of each outline; none where it has too few corners or was seen with too few points.

    ``polygons`` (v, 2) px; ``samples`` (n,): points that each outline was seen with.
    """
    seen = [int(n) if len(p) >= SMALLEST_POLYGON and n >= MINIMUM_POINTS else 0 for p, n in zip(polygons, samples, strict=True)]
    return [noise_px * rng.standard_normal((pairs, count)) for count in seen]


def bias_under(polygons: Sequence[Array], drawn: Sequence[Array]) -> Float[NDArray[np.float64], "n 180"]:
    """Bias (px) of the tangents of outlines (v, 2) px whose points have the noise ``drawn``; zero where there is none.

    ``polygons`` (v, 2) px, ``drawn`` (pairs, samples) px.
    """
    outward = outward_directions()
    curves = np.zeros((len(polygons), DIRECTIONS))
    for i, (points, noise) in enumerate(zip(polygons, drawn, strict=True)):
        if noise.size > 0:
            curves[i] = seen_support(points, noise, outward) - support(points, outward)
    return curves


def noise_digest(drawn: Sequence[Array]) -> str:
    """SHA-256 of drawn noise; ``drawn`` (pairs, samples) px of each outline."""
    total = hashlib.sha256(repr([noise.shape for noise in drawn]).encode())
    for noise in drawn:
        total.update(np.ascontiguousarray(noise).tobytes())
    return total.hexdigest()


def seen_support(points: Array, drawn: Array, outward: Array) -> Array:
    """Mean support (d,) px along ``outward`` (d, 2) of the hull of an outline (v, 2) px as it is seen: sampled, noisy, smoothed.

    ``drawn`` (pairs, samples) px: noise of its samples, which counts with both signs; zeros: there is none.
    ``points`` (v, 2) px.
    """
    return np.asarray(_mean_support(np.ascontiguousarray(points), drawn, WEIGHTS, np.ascontiguousarray(outward.T)))


def supports(silhouettes: Silhouettes) -> Float[NDArray[np.float64], "n 180"]:
    """Supports (px) of hulls along the directions of the bias curves; zero for an empty one."""
    outward = outward_directions()
    parts = [silhouettes.points_px[silhouettes.slice_of(i)] for i in range(len(silhouettes))]
    return np.stack([support(p, outward) if len(p) else np.zeros(DIRECTIONS) for p in parts])


def outward_directions() -> Float[NDArray[np.float64], "180 2"]:
    """Unit normals in the picture, from the first axis on in equal steps."""
    return unit_circle(DIRECTIONS)


def curve_at(curves: Array, row: Rows, direction: Array) -> Array:
    """Values of the curves ``row``, linear between directions, at normals ``direction`` (..., 2).

    ``curves`` (n, 180); ``row`` (...,), or what spreads to it.
    """
    place = np.arctan2(direction[..., 1], direction[..., 0]) / (2.0 * np.pi) * DIRECTIONS % DIRECTIONS
    low = np.floor(place).astype(np.int64) % DIRECTIONS
    share = place - np.floor(place)
    return np.asarray((1.0 - share) * curves[row, low] + share * curves[row, (low + 1) % DIRECTIONS])


FAST = {"nnan", "ninf", "nsz", "reassoc", "contract"}


@numba.njit(cache=True, fastmath=FAST)
def _lengths(points):  # type: ignore[no-untyped-def]
    """Lengths (v,) of a closed polygon's edges."""
    n = len(points)
    length = np.empty(n)
    for v in range(n):
        after = v + 1 if v + 1 < n else 0
        length[v] = np.sqrt((points[after, 0] - points[v, 0]) ** 2 + (points[after, 1] - points[v, 1]) ** 2)
    return length


@numba.njit(cache=True, fastmath=FAST)
def _samples_along(points, length, count, phase):  # type: ignore[no-untyped-def]
    """Coordinates (2, count) of points evenly along a closed polygon, the first ``phase`` steps from its start."""
    n, samples = len(points), np.empty((2, count))
    step, passed, v = length.sum() / count, 0.0, 0
    for j in range(count):
        where = (j + phase) * step
        while where > passed + length[v] and v < n - 1:
            passed += length[v]
            v += 1
        share, after = min(1.0, (where - passed) / max(length[v], 1e-12)), v + 1 if v + 1 < n else 0
        for a in range(2):
            samples[a, j] = points[v, a] + share * (points[after, a] - points[v, a])
    return samples


@numba.njit(cache=True, fastmath=FAST)
def _smoothed(samples, moved, weights):  # type: ignore[no-untyped-def]
    """The outline (2, n) with its samples ``moved`` (n,) along its normals, then smoothed."""
    n, half = samples.shape[1], len(weights) // 2
    noisy, smooth = np.empty((2, n + 2 * half)), np.zeros((2, n))
    before = n - 1
    for j in range(n):
        after = j + 1 if j + 1 < n else 0
        tx, ty = samples[0, after] - samples[0, before], samples[1, after] - samples[1, before]
        g = moved[j] / max(np.sqrt(tx * tx + ty * ty), 1e-12)
        noisy[0, half + j], noisy[1, half + j] = samples[0, j] + g * ty, samples[1, j] - g * tx
        before = j
    for a in range(2):
        noisy[a, :half], noisy[a, n + half :] = noisy[a, n : n + half], noisy[a, half : 2 * half]
        for w in range(len(weights)):
            for j in range(n):
                smooth[a, j] += weights[w] * noisy[a, j + w]
    return smooth


@numba.njit(cache=True, fastmath=FAST)
def _support(points, outward):  # type: ignore[no-untyped-def]
    """Support (d,) of points (2, n) along ``outward`` (2, d); directions are the inner loop, which processors do four at a time."""
    support = np.full(outward.shape[1], -1e300)
    for j in range(points.shape[1]):
        x, y = points[0, j], points[1, j]
        for d in range(outward.shape[1]):
            reach = x * outward[0, d] + y * outward[1, d]
            support[d] = reach if reach > support[d] else support[d]
    return support


@numba.njit(cache=True)
def _mean_support(points, drawn, weights, outward):  # type: ignore[no-untyped-def]
    """Mean support (d,) of the drawn outlines: for each row of ``drawn`` (pairs, n) its noise and the opposite one, which may be none."""
    support = np.zeros(outward.shape[1])
    pairs, count = drawn.shape
    twice, length = np.any(drawn != 0.0), _lengths(points)
    for i in range(pairs):
        samples = _samples_along(points, length, count, (i + 0.5) / pairs)
        support += _support(_smoothed(samples, drawn[i], weights), outward)
        if twice:
            support += _support(_smoothed(samples, -drawn[i], weights), outward)
    return support / ((2 if twice else 1) * pairs)
