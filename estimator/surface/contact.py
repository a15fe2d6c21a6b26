"""Where the samples of a seen outline lie beside the outline that a surface casts.

The outline of a mesh is the outer boundary of its contour generator: the edges between a face that looks at the camera and one that looks
away [Cipolla and Giblin, Visual Motion of Curves and Surfaces, 2000]. It is drawn finer than the pixels, every edge with its
number, to learn which of those edges is outermost where; distances are to the edges themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

import numba
import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from estimator.geometry.cast_outline import FINER, MARGIN_PX, boundary
from estimator.geometry.closed_curves import nearest
from estimator.motion.rigid_body import RanAway
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DRAWN_PX, COARSEST = 900, 4
"""Size of the drawing, and how much finer than the pixels it is at least."""
BUCKET = 8
"""Pixels of the drawing along a bucket in which the nearest of its points is looked for; any number finds the same."""
LEAST = 1e-9
"""More than rounding leaves of a length (px) or an angle that is none, and less than any other: of hulls' faces, 1e-13 and 1e-7."""


@dataclass(frozen=True)
class Contact:
    """What each of s samples meets: the edge from corner ``first`` to ``second`` (s,), a ``share`` (s,) of the way along it.

    Samples of k pictures one after the other, those of each from ``starts`` (k + 1,) on.

    ``point`` (s, 3) m there, camera coordinates; ``normal`` (s, 2) outward in the picture; ``gap_px`` (s,) of the sample outside of it.
    ``outward`` (s, 2): the outline's unit normals over a pixel to both sides, which noise turns less than those of edges.
    """

    starts: Index
    first: Index
    second: Index
    share: Array
    point: Array
    normal: Array
    gap_px: Array
    outward: Array

    def parts(self) -> "list[Contact]":
        """Those of each picture."""
        every = [getattr(self, each.name) for each in fields(self)[1:]]
        return [Contact(np.array([0, b - a]), *(each[a:b] for each in every)) for a, b in pairwise(self.starts.tolist())]

    @classmethod
    def together(cls, parts: "Sequence[Contact]") -> "Contact":
        """Those of all pictures."""
        every = (np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(cls)[1:])
        return cls(starts_of([part.share for part in parts]), *every)

    def across(self, pictures: "Sequence[Picture]", normal: Array) -> Array:
        """By how much (s, 3) px/m the cast outline moves along a ``normal`` (s, 2) where the body's points move, camera coordinates."""
        focal_px = np.array([[each.camera.fx_px, each.camera.fy_px] for each in pictures])
        return np.asarray(_across(self.point, normal, focal_px, self.starts))


@dataclass(frozen=True, eq=False)
class Picture:
    """A camera, the pose it sees a particle at, ``R_cam_particle`` (3, 3) and ``t_cam_particle`` (3,) m, and ``samples_px`` (s, 2)."""

    camera: Intrinsics
    R_cam_particle: Array
    t_cam_particle: Array
    samples_px: Array


def starts_of(parts: Sequence[Array]) -> Index:
    """Where each of k parts begins (k + 1,) where they follow one another."""
    return np.cumsum([0, *map(len, parts)])


@numba.njit(cache=True)
def turned(vectors, starts, R):  # type: ignore[no-untyped-def]
    """Vectors (s, 3) in the coordinates that matrices ``R`` (k, 3, 3) lead from, those from each of ``starts`` (k + 1,) on by the next."""
    into = np.empty_like(vectors)
    for k in range(len(R)):
        for s in range(starts[k], starts[k + 1]):
            for i in range(3):
                into[s, i] = vectors[s, 0] * R[k, 0, i] + vectors[s, 1] * R[k, 1, i] + vectors[s, 2] * R[k, 2, i]
    return into


def contacts_of(surface: Surface, pictures: Sequence[Picture]) -> Contact:
    """What the samples of all pictures' outlines, one after the other, meet of a surface.

    Raises
    ------
    RanAway
        Where corners lie behind the camera, the surface is larger than its picture, or samples are no numbers.
    """
    mesh, samples_px = surface.sphere.mesh, np.concatenate([each.samples_px for each in pictures])
    R, t = np.array([each.R_cam_particle for each in pictures]), np.array([each.t_cam_particle for each in pictures])
    if not (surface.vertices @ R[:, 2].T + t[:, 2] > 0.0).all():
        raise RanAway("a surface ran away behind the camera")
    edge, starts = _rims(surface.vertices, (mesh.faces, mesh.ends, mesh.beside), -np.einsum("kij,ki->kj", R, t))
    ends = mesh.ends[edge]
    cam, ideal = _in_cameras(surface.vertices, ends, starts, R, t)
    parts = zip(pictures, starts[:-1].tolist(), starts[1:].tolist(), strict=True)
    pixels = np.concatenate([each.camera.distort(ideal[a:b].reshape(-1, 2)) for each, a, b in parts]).reshape(-1, 2, 2)
    most_px = np.array([each.camera.width_px + each.camera.height_px for each in pictures], dtype=np.float64)
    bounds = _bounds(pixels, starts)
    if not np.all(np.max(bounds[:, 1] - bounds[:, 0], axis=1) <= most_px):
        raise RanAway("a surface ran away out of the picture")
    if not np.all(np.isfinite(samples_px)):
        raise RanAway("samples ran away with their picture")  # nothing is nearest to them, and the search would never end
    samples_from = starts_of([each.samples_px for each in pictures])
    at, *met = _met(samples_px, samples_from, (cam, pixels, bounds), starts)
    first, second = np.ascontiguousarray(ends[at].T)
    return Contact(samples_from, first, second, *met)


@numba.njit(cache=True)
def _across(point, normal, focal_px, starts):  # type: ignore[no-untyped-def]
    across = np.empty_like(point)
    for k in range(len(focal_px)):
        for s in range(starts[k], starts[k + 1]):
            u, v, z = normal[s, 0] * focal_px[k, 0], normal[s, 1] * focal_px[k, 1], point[s, 2]
            across[s, 0], across[s, 1], across[s, 2] = u / z, v / z, -(u * point[s, 0] + v * point[s, 1]) / z**2
    return across


@numba.njit(cache=True)
def _rims(vertices, mesh, eyes):  # type: ignore[no-untyped-def]
    """Edges between a face turned towards each viewpoint of ``eyes`` (k, 3) m and one turned away, and where those of each begin (k + 1,).

    ``mesh``: its faces, edges, and the faces beside those. One seen edge-on counts as turned away: a hull has hundreds of them, in the
    cones that carved it, and rounding would say which way they are turned.
    """
    faces, ends, beside = mesh
    normals, level, size = np.empty((3, len(faces))), np.empty(len(faces)), np.empty(len(faces))
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            normals[i, f] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j])
        level[f] = normals[0, f] * a[0] + normals[1, f] * a[1] + normals[2, f] * a[2]
        size[f] = LEAST * np.sqrt(normals[0, f] ** 2 + normals[1, f] ** 2 + normals[2, f] ** 2)
    seen, found, count, starts = np.empty(len(faces), np.bool_), np.empty(len(ends), np.int64), 0, np.zeros(len(eyes) + 1, np.int64)
    for number in range(len(eyes)):
        x, y, z = eyes[number, 0], eyes[number, 1], eyes[number, 2]
        far = np.sqrt(x**2 + y**2 + z**2)
        for f in range(len(faces)):
            seen[f] = normals[0, f] * x + normals[1, f] * y + normals[2, f] * z > level[f] + size[f] * far
        if len(found) < count + len(ends):
            found = np.concatenate((found, np.empty(count + len(ends), np.int64)))
        for e in range(len(ends)):
            found[count] = e
            count += seen[beside[e, 0]] != seen[beside[e, 1]]
        starts[number + 1] = count
    return found[:count], starts


@numba.njit(cache=True, error_model="numpy")
def _in_cameras(vertices, ends, starts, R, t):  # type: ignore[no-untyped-def]
    """Ends of edges (e, 2) in camera coordinates (e, 2, 3) m and normalised (e, 2, 2); a camera's begin at one of ``starts`` (k + 1,)."""
    cam, ideal = np.empty((len(ends), 2, 3)), np.empty((len(ends), 2, 2))
    for number in range(len(R)):
        for e in range(starts[number], starts[number + 1]):
            for end in range(2):
                p = vertices[ends[e, end]]
                for k in range(3):
                    cam[e, end, k] = R[number, k, 0] * p[0] + R[number, k, 1] * p[1] + R[number, k, 2] * p[2] + t[number, k]
                ideal[e, end, 0], ideal[e, end, 1] = cam[e, end, 0] / cam[e, end, 2], cam[e, end, 1] / cam[e, end, 2]
    return cam, ideal


@numba.njit(cache=True)
def _bounds(pixels, starts):  # type: ignore[no-untyped-def]
    """Least and largest (k, 2, 2) of the ends (e, 2, 2) px of each picture's edges."""
    bounds = np.empty((len(starts) - 1, 2, 2))
    for k in range(len(bounds)):
        bounds[k, 0], bounds[k, 1] = np.inf, -np.inf
        for e in range(starts[k], starts[k + 1]):
            for end in range(2):
                for axis in range(2):
                    bounds[k, 0, axis] = min(bounds[k, 0, axis], pixels[e, end, axis])
                    bounds[k, 1, axis] = max(bounds[k, 1, axis], pixels[e, end, axis])
    return bounds


@numba.njit(cache=True)
def _met(samples, sample_starts, rims, starts):  # type: ignore[no-untyped-def]
    """Of all pictures' samples (s, 2) px: edge, share of the way along it, point m, normal, gap px, and outward normals over a pixel.

    ``rims``: the ends of the pictures' edges (e, 2, 3) m in camera coordinates and (e, 2, 2) px, and the bounds (k, 2, 2) px of these.
    """
    cam, pixels, bounds = rims
    edge, share, point = np.empty(len(samples), np.int64), np.empty(len(samples)), np.empty((len(samples), 3))
    normal, gap, outward = np.empty_like(samples), np.empty(len(samples)), np.empty_like(samples)
    canvas = np.zeros(0, np.int32)
    for k in range(len(bounds)):
        mine, rim = slice(sample_starts[k], sample_starts[k + 1]), slice(starts[k], starts[k + 1])
        low, high = bounds[k, 0], bounds[k, 1]
        finer = int(min(max(DRAWN_PX / max(high[0] - low[0], high[1] - low[1]), COARSEST), FINER))
        width, height = int((high[0] - low[0] + 2.0 * MARGIN_PX) * finer) + 1, int((high[1] - low[1] + 2.0 * MARGIN_PX) * finer) + 1
        if len(canvas) < width * height:
            canvas = np.zeros(width * height, np.int32)
        drawn, drawn_edge = boundary(canvas[: width * height].reshape(height, width), pixels[rim], low - MARGIN_PX, finer)
        at = nearest(drawn, samples[mine], BUCKET / finer)
        edge[mine], outward[mine] = drawn_edge[at] + starts[k], _outward(drawn, finer, at)
        _meet(samples[mine], (edge[mine], outward[mine]), (cam, pixels), (share[mine], point[mine], normal[mine], gap[mine]))
    return edge, share, point, normal, gap, outward


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
        length = max(np.hypot(x, y), LEAST)
        normal[k, 0], normal[k, 1] = y / length, -x / length
    return normal


@numba.njit(cache=True)
def _meet(samples, shown, rim, met):  # type: ignore[no-untyped-def]
    """Fill in where samples (s, 2) lie beside edges: share (s,) of the way, point (s, 3) m, normal (s, 2) there, gap (s,).

    ``shown``: the edge of each sample (s,), the outline's normal there (s, 2); ``rim``: ends of edges (e, 2, 3) m and (e, 2, 2) px.
    """
    (edges, outward), (cam, pixels), (share, point, normal, gap) = shown, rim, met
    for k in range(len(samples)):
        first, second = pixels[edges[k], 0], pixels[edges[k], 1]
        x, y = second[0] - first[0], second[1] - first[1]
        from_x, from_y = samples[k, 0] - first[0], samples[k, 1] - first[1]
        share[k] = min(max((from_x * x + from_y * y) / max(x * x + y * y, LEAST**2), 0.0), 1.0)
        u, v = from_x - share[k] * x, from_y - share[k] * y
        size = np.hypot(u, v)
        if 0.0 < share[k] < 1.0 or size <= LEAST:
            length = max(np.hypot(x, y), LEAST)
            sign = -1.0 if y * outward[k, 0] - x * outward[k, 1] < 0.0 else 1.0
            normal[k, 0], normal[k, 1] = sign * y / length, -sign * x / length
        else:  # at a corner
            sign = -1.0 if u * outward[k, 0] + v * outward[k, 1] < 0.0 else 1.0
            normal[k, 0], normal[k, 1] = sign * u / size, sign * v / size
        gap[k] = -size if u * normal[k, 0] + v * normal[k, 1] < 0.0 else size
        for axis in range(3):
            point[k, axis] = cam[edges[k], 0, axis] * (1.0 - share[k]) + cam[edges[k], 1, axis] * share[k]
