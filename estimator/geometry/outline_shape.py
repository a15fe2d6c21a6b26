"""The shape of the outlines that a hull casts, by direction of the normal: how flat they are, and how far they recede.

Taken from the outlines that the fitted body would cast: those of a noisy outline depend on its noise, and would explain it.

A blur of standard deviation ``s`` moves the half level of a silhouette as curvature does: a smooth stretch by ``s² / (2 rho)`` [Verbeek and
van Vliet 1994], a corner that turns by ``phi`` by about ``0.4 s phi``. Smoothing the outline's points along the arc with a Gaussian of the
same ``s`` does both (``0.8 s sin(phi / 2)`` at a corner; a right angle's true value is 0.77 s instead of 0.56 s), and that is tabled.

An outline drawn too tight by ``d`` is the inner parallel curve. Along a smooth stretch its tangents recede by ``d``, at a corner by more:
its sides move by ``d`` and their intersection by ``d / cos(phi / 2)`` [Serra 1982, erosion]. An outline drawn too wide is round at the
corners, and all its tangents move by ``d``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.vocabulary.effects import FLATNESS_HALF_ANGLE_DEG, FLATNESS_REACH_PX

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ANGLES = 72
"""Directions of the normal, every five degrees from the picture's x axis."""
BLURS_PX = np.array([0.5, 1.0, 2.0, 4.0, 8.0])
"""Standard deviations (S,) of the tabled blurs."""
DEPTHS_PX = np.array([0.25, 0.5, 1.0, 2.0, 4.0])
"""Depths (D,) of the tabled inner parallel curves."""
SAMPLES = 512
MINIMUM_VERTICES = 3
MITRE_LIMIT = 20.0
HALF_ANGLE = np.radians(FLATNESS_HALF_ANGLE_DEG)


@dataclass(frozen=True)
class OutlineShape:
    """Of n outlines in 72 directions of the normal.

    ``radius_px`` (n, 72) radius of curvature: the length of outline within 10 degrees over 20 degrees. ``flattest_px`` (n, 72) the largest
    radius within 3 px of outline from where the tangent touches. ``recession`` (n, 72, S) px⁻¹: recession under a blur over its square.
    ``erosion`` (n, 72, D): recession of the tangents of an inner parallel curve over its depth, 1 where the outline is smooth.
    ``perimeter_radius_px`` (n,): the outline's length over 2 pi. ``radius_px`` is that of the convex hull; hollows count in all others.
    """

    radius_px: Array
    flattest_px: Array
    recession: Array
    erosion: Array
    perimeter_radius_px: Array

    def take(self, rows: Index) -> "OutlineShape":
        """The outlines ``rows`` alone."""
        return OutlineShape(
            self.radius_px[rows], self.flattest_px[rows], self.recession[rows], self.erosion[rows], self.perimeter_radius_px[rows]
        )


def outline_shape(polygons: Sequence[Array]) -> OutlineShape:
    """The shape of outlines (v, 2) px, either way round; zeros where there are fewer than three corners."""
    n = len(polygons)
    shape = OutlineShape(
        np.zeros((n, ANGLES)),
        np.zeros((n, ANGLES)),
        np.zeros((n, ANGLES, len(BLURS_PX))),
        np.ones((n, ANGLES, len(DEPTHS_PX))),
        np.zeros(n),
    )
    for i, polygon in enumerate(polygons):
        if len(polygon) >= MINIMUM_VERTICES:
            points = _positive(polygon)
            shape.radius_px[i] = _radii(_positive(points[ConvexHull(points).vertices]))
            shape.flattest_px[i] = _flattest(points, _radii(points))
            shape.recession[i] = _recession(points)
            shape.erosion[i] = _erosion(points)
            shape.perimeter_radius_px[i] = _edges(points)[0].sum() / (2.0 * np.pi)
    return shape


def _positive(points: Array) -> Array:
    """The same polygon, counted from the x axis towards the y axis."""
    after = np.roll(points, -1, axis=0)
    area = float(np.sum(points[:, 0] * after[:, 1] - points[:, 1] * after[:, 0]))
    return points if area > 0 else points[::-1]


def outward() -> Array:
    """The directions (72, 2) of the tables."""
    angle = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _edges(points: Array) -> tuple[Array, Array]:
    """Lengths (v,) px of the edges after each corner, and the angles (v,) of their outward normals."""
    edge = np.roll(points, -1, axis=0) - points
    return np.linalg.norm(edge, axis=1), np.arctan2(-edge[:, 0], edge[:, 1])


def _radii(points: Array) -> Array:
    length, normal = _edges(points)
    grid = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    apart = np.abs((grid[:, None] - normal + np.pi) % (2.0 * np.pi) - np.pi)
    return np.asarray(np.where(apart <= HALF_ANGLE, length, 0.0).sum(axis=1) / (2.0 * HALF_ANGLE))


def _flattest(points: Array, radius_px: Array) -> Array:
    """The largest radius of any edge that comes within reach of the corner that a tangent touches."""
    length, normal = _edges(points)
    start = np.concatenate([[0.0], np.cumsum(length)])
    perimeter, start = start[-1], start[:-1]
    at = start[np.argmax(points @ outward().T, axis=0)]
    ahead = (start - at[:, None]) % perimeter
    distance = np.where(ahead + length >= perimeter, 0.0, np.minimum(ahead, perimeter - ahead - length))
    own = radius_px[np.round(normal / (2.0 * np.pi) * ANGLES).astype(np.int64) % ANGLES]
    near = np.where(distance <= FLATNESS_REACH_PX, own, 0.0).max(axis=1)
    return np.asarray(np.maximum(near, radius_px))


def _recession(points: Array) -> Array:
    """Recession (72, S) of the tangents under each blur, over the blur's square."""
    length, _ = _edges(points)
    start = np.concatenate([[0.0], np.cumsum(length)])
    place = np.arange(SAMPLES) * (start[-1] / SAMPLES)
    closed = np.vstack([points, points[:1]])
    ring = np.interp(place, start, closed[:, 0]) + 1j * np.interp(place, start, closed[:, 1])
    frequency = 2.0 * np.pi * np.fft.fftfreq(SAMPLES, d=start[-1] / SAMPLES)
    blurred = np.fft.ifft(np.fft.fft(ring) * np.exp(-0.5 * (BLURS_PX[:, None] * frequency) ** 2), axis=1)
    u = outward()
    reach = (blurred.real[:, :, None] * u[:, 0] + blurred.imag[:, :, None] * u[:, 1]).max(axis=1)
    return np.asarray((((points @ u.T).max(axis=0) - reach) / BLURS_PX[:, None] ** 2).T)


def _erosion(points: Array) -> Array:
    """Recession (72, D) of the tangents of the inner parallel curves over their depths; the last one's where nothing is left."""
    u = outward()
    reach = (points @ u.T).max(axis=0)
    ratio = np.ones((ANGLES, len(DEPTHS_PX)))
    for i, inner in enumerate(shapely.buffer(shapely.Polygon(points), -DEPTHS_PX, join_style="mitre", mitre_limit=MITRE_LIMIT)):
        if inner.is_empty:
            ratio[:, i:] = ratio[:, max(i - 1, 0)][:, None]
            break
        ratio[:, i] = (reach - (shapely.get_coordinates(inner) @ u.T).max(axis=0)) / DEPTHS_PX[i]
    return ratio
