"""What outlines do at their own points, sector by sector as seen from their middle: how far blur, leaks and smear displace them.

A point of a displaced outline is compared with the outline as it was by its distance, as samples are compared with the outline that a
surface casts. Near a corner that a blur has cut, points lie inside of both sides of it: the sectors there recede, by less than tangents do.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, cKDTree

from estimator.geometry.closed_curves import nearest, resampled
from estimator.geometry.outline_shape import (
    ANGLES,
    BLURS_PX,
    DEPTHS_PX,
    MINIMUM_VERTICES,
    OutlineShape,
    leak_of,
    positive,
    radii,
    recession_of,
    recession_of_points,
)
from estimator.geometry.outline_smear import LEVELS, losses_of_smear

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STEP_PX, FINE_PX, FEWEST = 1.0, 0.25, 64
"""Distances of the points that are compared, and of those they are compared with, and their least number: samples of recordings are about
a pixel apart."""


def sectors_of(points: Array, middle: Array, count: int) -> Index:
    """Sector (v,), of ``count`` from the x axis on, of points (v, 2) about a ``middle`` (2,)."""
    turn = np.arctan2(points[:, 1] - middle[1], points[:, 0] - middle[0]) / (2.0 * np.pi)
    return np.asarray(np.floor(turn * count).astype(np.int64) % count)


class SectorRuler:
    """How far outside of an outline ``points`` (v, 2) px, counted positively, the points of other curves lie, in each of ``count`` sectors.

    ``middle`` (2,) px of the outline.
    """

    def __init__(self, points: Array, count: int) -> None:
        self.points, self.count = points, count
        self.middle = resampled(points, STEP_PX, fewest=FEWEST).mean(axis=0)

    @cached_property
    def _fine(self) -> tuple[Array, Array]:
        """Points of the outline, and outward normals there."""
        fine = resampled(self.points, FINE_PX, fewest=FEWEST)
        chord = np.roll(fine, -1, axis=0) - np.roll(fine, 1, axis=0)
        normal = np.column_stack([chord[:, 1], -chord[:, 0]])
        return fine, normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)

    def plain(self, curve: Array) -> Array:
        """Mean distance (count,) px of the points of a ``curve`` (m, 2) px, positive outside; between neighbours' where there is none."""
        return self._itself if curve is self.points else self._measured(curve)

    @cached_property
    def _itself(self) -> Array:
        return self._measured(self.points)

    def _measured(self, curve: Array) -> Array:
        if not np.isfinite(curve).all():
            raise ValueError("expected a curve of numbers, got one that ran away")  # the search for what is nearest would never end
        even, (fine, normal) = resampled(curve, STEP_PX, fewest=FEWEST), self._fine
        met = nearest(fine, even, STEP_PX)
        return self._means(even, np.asarray(np.sum((even - fine[met]) * normal[met], axis=1)))

    noisy = smooth = plain

    def _means(self, points: Array, values: Array) -> Array:
        """Means (count,) over the sectors of points, between neighbours' where there is none."""
        sector = sectors_of(points, self.middle, self.count)
        number = np.bincount(sector, minlength=self.count)
        told = np.flatnonzero(number)
        means = np.bincount(sector, values, self.count)[told] / number[told]
        return np.asarray(np.interp(np.arange(self.count), told, means, period=self.count))

    @cached_property
    def corners(self) -> Index:
        """The corner (count,) of the outline nearest to the middle of each sector's points."""
        fine, _ = self._fine
        means = np.column_stack([self._means(fine, fine[:, axis]) for axis in range(2)])
        return np.asarray(cKDTree(self.points).query(means)[1])

    @cached_property
    def normals(self) -> Array:
        """Mean outward normal (count, 2) of each sector."""
        fine, normal = self._fine
        means = np.column_stack([self._means(fine, normal[:, axis]) for axis in range(2)])
        return np.asarray(means / np.maximum(np.linalg.norm(means, axis=1, keepdims=True), 1e-12))


def sector_shape(polygons: Sequence[Array], motions: Array, count: int) -> OutlineShape:
    """The shape (n, count, ...) of outlines (v, 2) px, either way round, by sector.

    Where points recede along their own normals, sides meet at corners and part in hollows: there the outline that is left is nearer.
    ``motions`` (n, 3, 2): how each moves during the exposure. ``polygons`` (v, 2) px; zeros where there are fewer than three corners.
    """
    n = len(polygons)
    erosion, parallel = np.ones((2, n, count, len(DEPTHS_PX)))
    radius, sharpness = np.zeros((n, count)), np.zeros((n, count))
    recession, leak, smear = (np.zeros((n, count, k)) for k in (len(BLURS_PX), len(DEPTHS_PX), len(LEVELS)))
    for i, polygon in enumerate(polygons):
        if len(polygon) < MINIMUM_VERTICES:
            continue
        points = positive(polygon)
        ruler = SectorRuler(points, count)
        turn = np.arctan2(ruler.normals[:, 1], ruler.normals[:, 0]) / (2.0 * np.pi)
        radius[i] = radii(positive(points[ConvexHull(points).vertices]))[np.round(turn * ANGLES).astype(np.int64) % ANGLES]
        sharpness[i], recession[i] = recession_of(points, ruler)
        erosion[i], leak[i] = recession_of_points(points, ruler), leak_of(points, ruler)
        smear[i] = losses_of_smear(points, motions[i], ruler.plain, (ruler.corners, ruler.normals))
    return OutlineShape(radius, sharpness, recession, erosion, parallel, leak, smear)
