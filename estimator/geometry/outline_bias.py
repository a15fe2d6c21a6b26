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
from scipy.signal import savgol_coeffs

from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.silhouettes import Silhouettes
from estimator.geometry.tangent_hull import MINIMUM_POINTS, WINDOW

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
DIRECTIONS = 180
SMALLEST_POLYGON = 3
WEIGHTS = savgol_coeffs(WINDOW, 2)


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
    """Noise (pairs, samples) px of the points of each outline; none where it has too few corners or was seen with too few points."""
    seen = [int(n) if len(p) >= SMALLEST_POLYGON and n >= MINIMUM_POINTS else 0 for p, n in zip(polygons, samples, strict=True)]
    return [noise_px * rng.standard_normal((pairs, count)) for count in seen]


def bias_under(polygons: Sequence[Array], drawn: Sequence[Array]) -> Float[NDArray[np.float64], "n 180"]:
    """Bias (px) of the tangents of outlines (v, 2) px whose points have the noise ``drawn``; zero where there is none."""
    outward = outward_directions()
    curves = np.zeros((len(polygons), DIRECTIONS))
    for i, (points, noise) in enumerate(zip(polygons, drawn, strict=True)):
        if noise.size > 0:
            closed = np.ascontiguousarray(np.concatenate([points, points[:1]]))
            curves[i] = _mean_support(closed, noise, WEIGHTS, outward) - (points @ outward.T).max(axis=0)
    return curves


def noise_digest(drawn: Sequence[Array]) -> str:
    """SHA-256 of drawn noise."""
    total = hashlib.sha256(repr([noise.shape for noise in drawn]).encode())
    for noise in drawn:
        total.update(np.ascontiguousarray(noise).tobytes())
    return total.hexdigest()


def seen_support(points: Array, noise_px: float, samples: int, outward: Array, *, pairs: int, seed: int) -> Array:
    """Mean support (d,) px along ``outward`` (d, 2) of the hull of an outline (v, 2) px as it is seen: ``samples`` points, noisy, smoothed.

    ``pairs`` of draws of opposite noise from ``seed``.
    """
    drawn = noise_px * np.random.default_rng(seed).standard_normal((pairs, samples))
    closed = np.ascontiguousarray(np.concatenate([points, points[:1]]))
    return np.asarray(_mean_support(closed, drawn, WEIGHTS, outward))


def supports(silhouettes: Silhouettes) -> Float[NDArray[np.float64], "n 180"]:
    """Supports (px) of hulls along the directions of the bias curves; zero for an empty one."""
    outward = outward_directions()
    parts = [silhouettes.points_px[silhouettes.slice_of(i)] for i in range(len(silhouettes))]
    return np.stack([(p @ outward.T).max(axis=0) if len(p) else np.zeros(DIRECTIONS) for p in parts])


def outward_directions() -> Float[NDArray[np.float64], "180 2"]:
    """Unit normals in the picture, from the first axis on in equal steps."""
    return unit_circle(DIRECTIONS)


def curve_at(curves: Array, row: Rows, direction: Array) -> Array:
    """Values of the curves ``row``, linear between directions, at normals ``direction`` (..., 2)."""
    place = np.arctan2(direction[..., 1], direction[..., 0]) / (2.0 * np.pi) * DIRECTIONS % DIRECTIONS
    low = np.floor(place).astype(np.int64) % DIRECTIONS
    share = place - np.floor(place)
    return np.asarray((1.0 - share) * curves[row, low] + share * curves[row, (low + 1) % DIRECTIONS])


@numba.njit(cache=True)
def _samples_along(closed, count, phase):  # type: ignore[no-untyped-def]
    """``count`` points evenly along a closed polygon, the first ``phase`` steps from its start."""
    total = 0.0
    for v in range(closed.shape[0] - 1):
        total += np.hypot(closed[v + 1, 0] - closed[v, 0], closed[v + 1, 1] - closed[v, 1])
    points = np.empty((count, 2))
    step, passed, v = total / count, 0.0, 0
    length = np.hypot(closed[1, 0] - closed[0, 0], closed[1, 1] - closed[0, 1])
    for j in range(count):
        where = (j + phase) * step
        while where > passed + length and v < closed.shape[0] - 2:
            passed += length
            v += 1
            length = np.hypot(closed[v + 1, 0] - closed[v, 0], closed[v + 1, 1] - closed[v, 1])
        share = min(1.0, (where - passed) / max(length, 1e-12))
        for a in range(2):
            points[j, a] = closed[v, a] + share * (closed[v + 1, a] - closed[v, a])
    return points


@numba.njit(cache=True, fastmath={"nnan", "ninf", "nsz", "reassoc", "contract"})
def _add_supports(points, moved, weights, outward, support):  # type: ignore[no-untyped-def]
    """Add the supports of the outline with its points ``moved`` along its normals, then smoothed."""
    n, half = len(points), len(weights) // 2
    noisy, x, y = np.empty((n, 2)), np.zeros(n), np.zeros(n)
    for j in range(n):
        tx = points[(j + 1) % n, 0] - points[j - 1, 0]
        ty = points[(j + 1) % n, 1] - points[j - 1, 1]
        g = moved[j] / max(np.hypot(tx, ty), 1e-12)
        noisy[j, 0] = points[j, 0] + g * ty
        noisy[j, 1] = points[j, 1] - g * tx
    for j in range(n):
        for w in range(-half, half + 1):
            x[j] += weights[w + half] * noisy[(j + w) % n, 0]
            y[j] += weights[w + half] * noisy[(j + w) % n, 1]
    for d in range(outward.shape[0]):
        u, v, best = outward[d, 0], outward[d, 1], -1e300
        for j in range(n):
            reach = x[j] * u + y[j] * v
            best = reach if reach > best else best
        support[d] += best


@numba.njit(cache=True)
def _mean_support(closed, drawn, weights, outward):  # type: ignore[no-untyped-def]
    """Mean support (d,) of the drawn outlines: for each row of ``drawn`` (pairs, n) its noise and the opposite one, which may be none."""
    support = np.zeros(outward.shape[0])
    pairs, count = drawn.shape
    twice = np.any(drawn != 0.0)
    for i in range(pairs):
        points = _samples_along(closed, count, (i + 0.5) / pairs)
        _add_supports(points, drawn[i], weights, outward, support)
        if twice:
            _add_supports(points, -drawn[i], weights, outward, support)
    return support / ((2 if twice else 1) * pairs)
