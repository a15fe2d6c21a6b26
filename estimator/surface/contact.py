"""Where the samples of a seen outline lie beside the outline that a surface casts.

The outline of a mesh is the outer boundary of its contour generator: the edges between a face that looks at the camera and one that looks
away [Cipolla and Giblin, Visual Motion of Curves and Surfaces, 2000]. It is drawn finer than the pixels, every edge with its
number, to learn which of those edges is outermost where; distances are to the edges themselves.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from estimator.geometry.cast_outline import FINER, Canvas, bounds, contour_generator, drawn_edges
from estimator.geometry.closed_curves import nearest
from estimator.motion.rigid_body import RanAway
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DRAWN_PX, COARSEST = 900, 4
"""Size of the drawing, and how much finer than the pixels it is at least."""
BUCKET = 16
"""Pixels of the drawing along a bucket in which the nearest of its points is looked for; any number finds the same."""
LEAST_PX = 1e-9
"""What rounding leaves of a length that is none."""


@dataclass(frozen=True)
class Contact:
    """What each of s samples meets: the edge from corner ``first`` to ``second`` (s,), a ``share`` (s,) of the way along it.

    ``point`` (s, 3) m there, camera coordinates; ``normal`` (s, 2) outward in the picture; ``gap_px`` (s,) of the sample outside of it.
    ``outward`` (s, 2): the outline's unit normals over a pixel to both sides, which noise turns less than those of edges.
    """

    first: Index
    second: Index
    share: Array
    point: Array
    normal: Array
    gap_px: Array
    outward: Array


@dataclass(frozen=True, eq=False)
class Picture:
    """A camera, the pose it sees a particle at, ``R_cam_particle`` (3, 3) and ``t_cam_particle`` (3,) m, and ``samples_px`` (s, 2)."""

    camera: Intrinsics
    R_cam_particle: Array
    t_cam_particle: Array
    samples_px: Array


def contacts_of(surface: Surface, pictures: Iterable[Picture]) -> list[Contact]:
    """What the samples of every picture's outline meet of a surface.

    Raises
    ------
    RanAway
        Where corners lie behind the camera, the surface is larger than its picture, or samples are no numbers.
    """
    contacts, canvas = [], Canvas.empty()
    for picture in pictures:
        cam, pixels, low, high = _projected(surface, picture)
        rim = surface.sphere.mesh.ends[contour_generator(surface.sphere.mesh, pixels)]
        finer = int(min(max(DRAWN_PX / max(high - low), COARSEST), FINER))
        drawn, edge, canvas = drawn_edges(pixels, rim, finer, (low, high), canvas)
        samples_px = np.ascontiguousarray(picture.samples_px)
        if not np.all(np.isfinite(samples_px)):
            raise RanAway("samples ran away with their picture")  # nothing is nearest to them, and the search would never end
        at = nearest(drawn, samples_px, BUCKET / finer)
        outward = _outward(drawn, finer, at)
        first, second = np.ascontiguousarray(rim[edge[at]].T)
        share, point, normal, gap_px = _met(samples_px, (first, second), cam, pixels, outward)
        contacts.append(Contact(first, second, share, point, normal, gap_px, outward))
    return contacts


def _projected(surface: Surface, picture: Picture) -> tuple[Array, Array, Array, Array]:
    """The corners in camera coordinates (n, 3) m and in the picture (n, 2) px, and the least and largest (2,) px of these."""
    cam, ideal, ahead = _posed(surface.vertices, picture.R_cam_particle, picture.t_cam_particle)
    if not ahead:
        raise RanAway("a surface ran away behind the camera")
    pixels = picture.camera.distort(ideal)
    low, high = bounds(pixels)
    if not max(high - low) <= picture.camera.width_px + picture.camera.height_px:
        raise RanAway("a surface ran away out of the picture")
    return cam, pixels, low, high


@numba.njit(cache=True, error_model="numpy")
def _posed(points, R, t):  # type: ignore[no-untyped-def]
    """Points (n, 3) m in camera coordinates and ideal normalised ones (n, 2), and whether all lie before the camera."""
    cam, ideal, ahead = np.empty_like(points), np.empty((len(points), 2)), True
    for i in range(len(points)):
        for k in range(3):
            cam[i, k] = R[k, 0] * points[i, 0] + R[k, 1] * points[i, 1] + R[k, 2] * points[i, 2] + t[k]
        ahead = ahead and cam[i, 2] > 0.0
        ideal[i, 0], ideal[i, 1] = cam[i, 0] / cam[i, 2], cam[i, 1] / cam[i, 2]
    return cam, ideal, ahead


@numba.njit(cache=True)
def _outward(drawn, finer, at):  # type: ignore[no-untyped-def]
    """Outward unit normals (s, 2) ``at`` (s,) places of a boundary drawn (n, 2) px in order, over a pixel to both sides.

    Those of the edges themselves do not tell: the contour generator of a mesh goes to and fro across the outline.
    """
    n, twice = len(drawn), 0.0
    for i in range(n):
        twice += drawn[i, 0] * drawn[(i + 1) % n, 1] - drawn[(i + 1) % n, 0] * drawn[i, 1]
    normal = np.empty((len(at), 2))
    for k in range(len(at)):
        after, before = drawn[(at[k] + finer) % n], drawn[(at[k] - finer) % n]
        x, y = (after[0] - before[0]) * np.sign(twice), (after[1] - before[1]) * np.sign(twice)
        length = max(np.hypot(x, y), LEAST_PX)
        normal[k, 0], normal[k, 1] = y / length, -x / length
    return normal


@numba.njit(cache=True)
def _met(samples, ends, cam, pixels, outward):  # type: ignore[no-untyped-def]
    """Of samples (s, 2) beside edges between ``ends`` (s,), (s,): share (s,) of the way, point (s, 3) m, normal (s, 2) there, gap (s,).

    ``cam`` (n, 3) m and ``pixels`` (n, 2) of the corners.
    """
    share, normal, gap, point = np.empty(len(samples)), np.empty((len(samples), 2)), np.empty(len(samples)), np.empty((len(samples), 3))
    for k in range(len(samples)):
        first, second = ends[0][k], ends[1][k]
        x, y = pixels[second, 0] - pixels[first, 0], pixels[second, 1] - pixels[first, 1]
        from_x, from_y = samples[k, 0] - pixels[first, 0], samples[k, 1] - pixels[first, 1]
        share[k] = min(max((from_x * x + from_y * y) / max(x * x + y * y, LEAST_PX**2), 0.0), 1.0)
        u, v = from_x - share[k] * x, from_y - share[k] * y
        size = np.hypot(u, v)
        if 0.0 < share[k] < 1.0 or size <= LEAST_PX:
            length = max(np.hypot(x, y), LEAST_PX)
            sign = -1.0 if y * outward[k, 0] - x * outward[k, 1] < 0.0 else 1.0
            normal[k, 0], normal[k, 1] = sign * y / length, -sign * x / length
        else:  # at a corner
            sign = -1.0 if u * outward[k, 0] + v * outward[k, 1] < 0.0 else 1.0
            normal[k, 0], normal[k, 1] = sign * u / size, sign * v / size
        gap[k] = -size if u * normal[k, 0] + v * normal[k, 1] < 0.0 else size
        for axis in range(3):
            point[k, axis] = cam[first, axis] * (1.0 - share[k]) + cam[second, axis] * share[k]
    return share, point, normal, gap
