"""The shape of the outlines that a hull casts, by direction of the normal: how flat they are, and how far they recede.

Taken from the outlines that the fitted body would cast: those of a noisy outline depend on its noise, and would explain it.

A blur of standard deviation ``s`` moves the half level of a silhouette as curvature does: a smooth stretch by ``s² / (2 rho)`` [Verbeek and
van Vliet 1994], a corner by a share of ``s`` (a right angle by 0.77 s), a spike by more. The filled outline is drawn and blurred, and what
the tangents of its half level recede is tabled. Both are taken as they are seen, noisy and smoothed
(:mod:`estimator.geometry.outline_bias`): smoothing cuts a sharp spike and not one that the blur has made round.

An outline drawn too tight by ``d`` is the inner parallel curve. Along a smooth stretch its tangents recede by ``d``, at a corner by more:
its sides move by ``d`` and their intersection by ``d / cos(phi / 2)`` [Serra 1982, erosion]. An outline drawn too wide is round at the
corners, and all its tangents move by ``d``; smoothing no longer cuts what it cut, and as seen they move by more.

Light that leaks through facets along the line of sight moves each point of an outline by its own depth, ``d f / (1 + f)`` with the
flatness ``f`` of the catalogue (``rim_light_leak``): those points are moved, loops and what has turned inside out cut off [offsetting by
winding numbers, Chen and McMains 2005], and what the tangents recede is tabled.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Protocol

import cv2
import manifold3d
import numba
import numpy as np
import shapely
from contourpy import FillType, LineType, SerialContourGenerator, ZInterp
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.spatial import ConvexHull

from datasets.vocabulary.effects import FLATNESS_HALF_ANGLE_DEG, FLATNESS_REACH_PX
from estimator.geometry.closed_curves import area, largest_ring, resampled, unit_circle
from estimator.geometry.coverage import coverage
from estimator.geometry.hollows import hollow_share
from estimator.geometry.outline_bias import seen_support
from estimator.geometry.outline_smear import LEVELS, smear_losses
from estimator.geometry.support import support
from estimator.geometry.tangent_hull import MINIMUM_POINTS

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ANGLES = 144
"""Directions of the normal, every two and a half degrees from the picture's x axis; what a tangent recedes is continuous in between.

See notebook 18."""
BLURS_PX = np.array([0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 16.0])
"""Standard deviations (S,) of the tabled blurs: between steps of two, what spikes recede is 0.03 px off a straight line (notebook 29)."""
SHARP_BLUR_PX = 1.0
"""Standard deviation of the blur by which corners are told from sides; about as far as smoothing reaches."""
SEEN_PAIRS, SMOOTH_PHASES = 2, 4
"""Pairs of opposite draws of noise for every outline as it is seen, and places of its first sample where noise is left out."""
SIMPLER_PX = 0.01
"""How far a parallel curve's outline may be simplified."""
ARC_SEGMENTS = 16
"""Of a quarter of a circle about a corner."""
DEPTHS_PX = np.array([0.25, 0.5, 1.0, 2.0, 4.0])
"""Depths (D,) of the tabled inner parallel curves, and losses of light that are tabled."""
MINIMUM_VERTICES = 3
"""Below which an outline has no area."""
DRAWN_PX = 0.5
"""Side of a drawing's pixels."""
PER_BLUR = 5
"""Pixels in a blur, about: a wide one is applied to a drawing of larger pixels."""
BLURS_BESIDE = 3
"""Margin of the drawing, in blurs."""
MITRE_LIMIT = 20.0
"""Of a parallel curve's corners, over its distance: only angles below 6° are cut."""
LEAK_STEP_PX, FEWEST_POINTS = 0.5, 64
"""Distance of the points that a leak of light moves, and their least number."""
HALF_ANGLE = np.radians(FLATNESS_HALF_ANGLE_DEG)


@dataclass(frozen=True)
class Sampling:
    """How n outlines are seen: ``noise_px`` of their points, and how many ``samples`` (n,) each has."""

    noise_px: float
    samples: Index


@dataclass(frozen=True)
class OutlineShape:
    """Of n outlines in A directions of the normal.

    ``radius_px`` (n, A) radius of curvature of the convex hull: the length of outline within 10 degrees over 20 degrees. The others are of
    the outline with its hollows. ``sharpness`` (n, A) px⁻¹: recession under a blur of a pixel over its square. ``recession`` (n, A, S):
    recession under a blur over the blur. ``erosion`` (n, A, D): recession of the tangents of an inner parallel curve over its depth, 1
    where the outline is smooth; ``dilation`` (n, A, D): advance of those of an outer one. ``leak`` (n, A, D): recession under a leak of
    light over its loss. These four are of outlines as seen where it is known how they are. ``smear`` (n, A, L) px: that of a picture that
    moved during its exposure, beyond what the tangent's own movement says (:mod:`estimator.geometry.outline_smear`).
    """

    radius_px: Array
    sharpness: Array
    recession: Array
    erosion: Array
    dilation: Array
    leak: Array
    smear: Array

    def take(self, rows: Index) -> "OutlineShape":
        """The outlines ``rows`` (k,) alone."""
        return OutlineShape(*(getattr(self, each.name)[rows] for each in fields(self)))

    def towards(self, normals: Array) -> "OutlineShape":
        """The tables (n, k, 2, ...) at unit normals (n, k, 2, 2), linear between directions; the radius is that of the nearest.

        Where a normal is no number, nothing is told but a radius.
        """
        place = np.arctan2(normals[..., 1], normals[..., 0]) / (2.0 * np.pi) * ANGLES
        nearest = np.round(np.nan_to_num(place)).astype(np.int64) % ANGLES
        tables = (_between(table, place) for table in (self.sharpness, self.recession, self.erosion, self.dilation, self.leak, self.smear))
        return OutlineShape(self.radius_px[np.arange(len(normals))[:, None, None], nearest], *tables)


def _between(table: Array, place: Array) -> Array:
    """What a ``table`` (n, A, ...) says at places (n, k, 2) among its directions."""
    if len(table) < len(place):
        raise IndexError(f"expected tables of {len(place)} outlines, got {len(table)}")
    found = np.empty((*place.shape, *table.shape[2:]))
    tangents, columns = math.prod(place.shape[1:]), math.prod(table.shape[2:])
    flat = np.ascontiguousarray(table, dtype=np.float64).reshape(*table.shape[:2], columns)
    _lerp(flat, place.reshape(len(place), tangents), found.reshape(len(place), tangents, columns))
    return found


@numba.njit(cache=True)
def _lerp(table, place, found):  # type: ignore[no-untyped-def]
    n, tangents = place.shape
    angles, columns = table.shape[1:]
    for i in range(n):
        for j in range(tangents):
            if np.isnan(place[i, j]):  # of a flight led astray
                found[i, j] = np.nan
                continue
            low = int(np.floor(place[i, j]))
            share, here, there = place[i, j] - low, low % angles, (low + 1) % angles
            for c in range(columns):
                found[i, j, c] = (1.0 - share) * table[i, here, c] + share * table[i, there, c]


RELIABLE, RELIABLE_HOLLOW, HOLLOW = 0.9, 0.52, 0.02
"""How much of what a hull's leaks vary by is nature's on convex bodies, on those with hollows, and the hollow share half way between."""


def as_of_a_hull(shape: OutlineShape, polygons: Sequence[Array]) -> OutlineShape:
    """What the outlines of a visual hull, of this ``shape``, say of those of the body inside it.

    A hull has the body's hollows in part only, so which stretches are flat it knows of convex bodies and half of jagged ones. Leaks are
    drawn towards their mean by what bodies of both kinds showed, lest an error of the hull count as knowledge [regression calibration,
    Carroll, Ruppert, Stefanski and Crainiceanu 2006, ch. 4]; ``scripts/trials/study_hull_leaks.py`` measures how well.
    ``polygons`` (v, 2) px.
    """
    whole = [i for i, polygon in enumerate(polygons) if len(polygon) >= MINIMUM_VERTICES]
    if not whole:
        return shape
    mean = shape.leak[whole].mean(axis=(0, 1))
    reliable = RELIABLE_HOLLOW + (RELIABLE - RELIABLE_HOLLOW) / (1.0 + (hollow_share(polygons) / HOLLOW) ** 2)
    return replace(shape, leak=mean + reliable * (shape.leak - mean))


def outline_shape(
    polygons: Sequence[Array], motions: Array | None = None, flat: Sequence[Array] | None = None, sampling: Sampling | None = None
) -> OutlineShape:
    """The shape of outlines (v, 2) px, either way round; zeros where there are fewer than three corners.

    ``motions`` (n, 3, 2): how each moves during the exposure (:func:`estimator.geometry.outline_smear.smear_losses`), if it does.
    ``flat``: outlines of the same body that tell flat stretches, from which light leaks, where others are rough with noise.
    ``sampling``: how the outlines are seen; without it they are compared as they are.
    ``polygons``, ``flat`` (v, 2) px.
    """
    n = len(polygons)
    shape = OutlineShape(
        np.zeros((n, ANGLES)),
        np.zeros((n, ANGLES)),
        np.zeros((n, ANGLES, len(BLURS_PX))),
        np.ones((n, ANGLES, len(DEPTHS_PX))),
        np.ones((n, ANGLES, len(DEPTHS_PX))),
        np.ones((n, ANGLES, len(DEPTHS_PX))),
        np.zeros((n, ANGLES, len(LEVELS))),
    )
    for i, polygon in enumerate(polygons):
        if len(polygon) >= MINIMUM_VERTICES:
            points = positive(polygon)
            shape.radius_px[i] = radii(positive(points[ConvexHull(points).vertices]))
            sampler = _Sampler(sampling, i, points[0])
            shape.sharpness[i], shape.recession[i] = recession_of(points, sampler)
            shape.erosion[i], shape.dilation[i] = _parallel(points, sampler)
            shape.leak[i] = leak_of(points if flat is None else positive(flat[i]), sampler)
            if motions is not None:
                shape.smear[i] = smear_losses(points, motions[i], outward())
    return shape


def positive(points: Array) -> Array:
    """The same polygon ``points`` (v, 2) px, counted from the x axis towards the y axis."""
    return points if area(points) > 0 else points[::-1]


def outward() -> Array:
    """The directions (A, 2) of the tables."""
    return unit_circle(ANGLES)


def _edges(points: Array) -> tuple[Array, Array]:
    """Lengths (v,) px of the edges after each corner, and the angles (v,) of their outward normals."""
    edge = np.roll(points, -1, axis=0) - points
    return np.linalg.norm(edge, axis=1), np.arctan2(-edge[:, 0], edge[:, 1])


def radii(points: Array) -> Array:
    """Radii of curvature (A,) px of a convex outline ``points`` (v, 2) px, counted positively."""
    length, normal = _edges(points)
    grid = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    apart = np.abs((grid[:, None] - normal + np.pi) % (2.0 * np.pi) - np.pi)
    return np.asarray(np.where(apart <= HALF_ANGLE, length, 0.0).sum(axis=1) / (2.0 * HALF_ANGLE))


@dataclass(frozen=True)
class _Sampler:
    """How far curves (v, 2) px reach along the tabled directions (A,): as they are, or as outline ``number`` of a ``sampling`` is seen.

    All have the samples of the outline that was seen, as its predicted bias has, and the first of them next to ``start`` (2,) px, where the
    outline starts that the body casts; so an effect of nothing moves nothing.
    """

    sampling: Sampling | None
    number: int
    start: Array

    @property
    def sampled(self) -> bool:
        """Whether the outline was sampled at all."""
        return self.sampling is not None and self.sampling.samples[self.number] >= MINIMUM_POINTS

    @cached_property
    def noise(self) -> Array:
        """Draws (pairs, samples) px of the samples' noise, the same for all curves; none where the outline was not sampled."""
        if self.sampling is None or not self.sampled:
            return np.zeros((SEEN_PAIRS, 0))
        samples = int(self.sampling.samples[self.number])
        return self.sampling.noise_px * np.random.default_rng(self.number).standard_normal((SEEN_PAIRS, samples))

    def noisy(self, curve: Array) -> Array:
        """Noisy and smoothed, with the same noise for all."""
        return self._seen(curve, self.noise)

    def smooth(self, curve: Array) -> Array:
        """Smoothed, without the noise, which moves curves alike that differ by little."""
        return self._seen(curve, np.zeros((SMOOTH_PHASES, self.noise.shape[1])))

    def plain(self, curve: Array) -> Array:
        """As it is."""
        return support(curve, outward())

    def _seen(self, curve: Array, drawn: Array) -> Array:
        if not self.sampled:
            return support(curve, outward())
        x, y = (curve - self.start).T
        first = int(np.argmin(x**2 + y**2))
        return seen_support(np.concatenate([curve[first:], curve[:first]]), drawn, outward())


class Ruler(Protocol):
    """Says how far curves (v, 2) px reach at a number of places (a,) of an outline."""

    def plain(self, curve: Array) -> Array:
        """As a ``curve`` (v, 2) px is: (a,) px."""

    def noisy(self, curve: Array) -> Array:
        """As a ``curve`` (v, 2) px is seen: (a,) px."""

    def smooth(self, curve: Array) -> Array:
        """As a ``curve`` (v, 2) px is seen but for noise: (a,) px."""


def recession_of(points: Array, ruler: Ruler) -> tuple[Array, Array]:
    """Sharpness (a,), and recession (a, S) of an outline ``points`` (v, 2) px under each blur, over the blur.

    Where all that is left is less than a half, the last one's.
    """
    drawing, reach, sharp = _drawing(points), ruler.noisy(points), ruler.plain(points)
    ratio, sharpness = np.zeros((len(reach), len(BLURS_PX))), np.zeros(len(reach))
    for i, blur_px in enumerate(BLURS_PX):
        contour = _half_level(drawing, blur_px)
        ratio[:, i] = (reach - ruler.noisy(contour)) / blur_px if len(contour) else ratio[:, i - 1]
        if blur_px == SHARP_BLUR_PX and len(contour):
            sharpness = (sharp - ruler.plain(contour)) / SHARP_BLUR_PX**2
    return sharpness, ratio


def _half_level(drawing: tuple[NDArray[np.float32], Array], blur_px: float) -> Array:
    """The longest closed curve (m, 2) px, counted positively, on the half level of a drawing under a blur; none where all is below."""
    drawn, first = drawing
    blur = blur_px / DRAWN_PX
    larger = max(1, round(blur / PER_BLUR))
    margin = larger * int(np.ceil(BLURS_BESIDE * blur / larger))
    height, width = drawn.shape
    padded = cv2.copyMakeBorder(drawn, margin, margin + -height % larger, margin, margin + -width % larger, cv2.BORDER_CONSTANT, value=0.0)
    coarse = cv2.resize(padded, (padded.shape[1] // larger, padded.shape[0] // larger), interpolation=cv2.INTER_AREA)
    left = np.sqrt((blur / larger) ** 2 - 1.0 / 12.0)  # a pixel is a blur by itself
    level = cv2.GaussianBlur(coarse, (0, 0), left, borderType=cv2.BORDER_CONSTANT)
    curves = _level_curves(level)
    if not curves:
        return np.zeros((0, 2))
    longest = max(curves, key=len)[:-1]
    return positive(first + DRAWN_PX * ((longest + 0.5) * larger - 0.5 - margin))


def _level_curves(level: NDArray[np.float32]) -> Sequence[Array]:
    """The curves (m, 2), ends included, on the half level of a drawing, which has a margin below it.

    The generator is made as :func:`contourpy.contour_generator` does, whose masked arrays take longer than the curves, and of the part
    within which the curves lie.
    """
    above = level >= 0.5
    rows, columns = np.flatnonzero(above.any(axis=1)), np.flatnonzero(above.any(axis=0))
    if not len(rows):
        return []
    top, left = max(int(rows[0]) - 1, 0), max(int(columns[0]) - 1, 0)
    part = level[top : rows[-1] + 2, left : columns[-1] + 2].astype(np.float64)
    x, y = np.empty(part.shape), np.empty(part.shape)
    x[:], y[:] = np.arange(left, left + part.shape[1]), np.arange(top, top + part.shape[0])[:, None]
    made = SerialContourGenerator(
        x,
        y,
        part,
        None,  # type: ignore[arg-type]
        corner_mask=False,
        line_type=LineType.Separate,
        fill_type=FillType.OuterOffset,
        quad_as_tri=False,
        z_interp=ZInterp.Linear,
    )
    return made.lines(0.5)  # type: ignore[return-value]


def _drawing(points: Array) -> tuple[NDArray[np.float32], Array]:
    """What share of each pixel the filled outline covers, and where (2,) px the middle of the first pixel is."""
    first = points.min(axis=0) - 0.5 * DRAWN_PX
    width, height = (int(n) for n in np.ceil(np.ptp(points, axis=0) / DRAWN_PX) + 2)
    return coverage((points - first) / DRAWN_PX, (height, width)), first


def _parallel(points: Array, sampler: _Sampler) -> tuple[Array, Array]:
    """Recession (A, D) of the tangents of the inner parallel curves over their depths, and advance (A, D) of those of the outer ones.

    The last inner one's where nothing is left; outlines as they are advance by 1.
    """
    simple = shapely.get_coordinates(shapely.simplify(shapely.Polygon(points), SIMPLER_PX))[:-1]
    section, reach = manifold3d.CrossSection([simple]), sampler.smooth(simple)
    inner, outer = np.ones((ANGLES, len(DEPTHS_PX))), np.ones((ANGLES, len(DEPTHS_PX)))
    for i, depth in enumerate(DEPTHS_PX):
        left = section.offset(-depth, manifold3d.JoinType.Miter, MITRE_LIMIT).to_polygons()
        if not left:
            inner[:, i:] = inner[:, max(i - 1, 0)][:, None]
            break
        inner[:, i] = (reach - sampler.smooth(largest_ring(left))) / depth
    for i, depth in enumerate(DEPTHS_PX if sampler.sampled else ()):
        wide = section.offset(depth, manifold3d.JoinType.Round, circular_segments=4 * ARC_SEGMENTS).to_polygons()
        outer[:, i] = (sampler.smooth(largest_ring(wide)) - reach) / depth
    return inner, outer


def leak_of(points: Array, ruler: Ruler) -> Array:
    """Recession (a, D) of an outline ``points`` (v, 2) px under a leak of light over its loss; the last one's where nothing is left."""
    even, normal = _along_normals(points)
    reach_points = round(FLATNESS_REACH_PX * len(even) / float(_edges(points)[0].sum()))
    flatness = maximum_filter1d(_alike(normal) * np.pi / (HALF_ANGLE * len(even)), 2 * reach_points + 1, mode="wrap")
    return _receded(points, ruler, even, (flatness / (1.0 + flatness))[:, None] * normal)


def recession_of_points(points: Array, ruler: Ruler) -> Array:
    """Recession (a, D) of an outline ``points`` (v, 2) px, each moved inwards along its own normal, over the depth."""
    return _receded(points, ruler, *_along_normals(points))


def _along_normals(points: Array) -> tuple[Array, Array]:
    """Evenly spaced points (m, 2) px of an outline ``points`` (v, 2) px, and outward unit normals (m, 2) across twice the step."""
    even = resampled(points, LEAK_STEP_PX, fewest=FEWEST_POINTS)
    chord = np.roll(even, -1, axis=0) - np.roll(even, 1, axis=0)
    return even, np.column_stack([chord[:, 1], -chord[:, 0]]) / np.maximum(np.linalg.norm(chord, axis=1), 1e-9)[:, None]


def _receded(points: Array, ruler: Ruler, even: Array, away: Array) -> Array:
    """Recession (a, D) of an outline ``points`` (v, 2) px over depths by which its points ``even`` (m, 2) move against ``away`` (m, 2)."""
    reach = ruler.smooth(points)
    ratio = np.ones((len(reach), len(DEPTHS_PX)))
    for i, depth in enumerate(DEPTHS_PX):
        left = manifold3d.CrossSection([even - depth * away], manifold3d.FillRule.Positive).to_polygons()
        if not left:
            ratio[:, i:] = ratio[:, max(i - 1, 0)][:, None]
            break
        ratio[:, i] = (reach - ruler.smooth(largest_ring(left))) / depth
    return ratio


def _alike(normals: Array) -> Index:
    """How many (n,) of the unit normals (n, 2) lie within ``HALF_ANGLE`` of each."""
    angle = np.arctan2(normals[:, 1], normals[:, 0])
    around = np.sort(angle)
    around = np.concatenate([around - 2.0 * np.pi, around, around + 2.0 * np.pi])
    return np.searchsorted(around, angle + HALF_ANGLE, side="right") - np.searchsorted(around, angle - HALF_ANGLE, side="left")
