"""Where the samples of a seen outline lie beside the outline that a surface casts.

The outline of a mesh is the outer boundary of its contour generator: the edges between a face that looks at the camera and one that looks
away [Cipolla and Giblin, Visual Motion of Curves and Surfaces, 2000]. It is drawn finer than the pixels to learn which of those edges are
outermost; distances are to the edges themselves.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from datasets.vocabulary.camera import Intrinsics
from estimator.surface.star_surface import StarSurface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DRAWN_PX, FINEST, COARSEST = 1800, 16, 4
"""Size of the drawing, and how much finer than the pixels it is at most and at least."""
MARGIN_PX = 2.0
NEAREST = 3
"""Edges that are compared with a point of the drawn outline."""
LEAST_PX = 1e-9


@dataclass(frozen=True)
class Contact:
    """What each of s samples meets: the edge from corner ``first`` to ``second`` (s,), a ``share`` (s,) of the way along it.

    ``point`` (s, 3) m there, camera coordinates; ``normal`` (s, 2) outward in the picture; ``gap_px`` (s,) of the sample outside of it.
    """

    first: Index
    second: Index
    share: Array
    point: Array
    normal: Array
    gap_px: Array


def contact_of(surface: StarSurface, camera: Intrinsics, R_cam_particle: Array, t_cam_particle: Array, samples_px: Array) -> Contact:
    """What the samples (s, 2) px of an outline meet of a surface at a pose."""
    cam = surface.vertices @ R_cam_particle.T + t_cam_particle
    pixels = camera.project(cam)
    rim, third = _contour_generator(surface, pixels)
    start = pixels[rim[:, 0]]
    along = pixels[rim[:, 1]] - start
    rim_normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(np.linalg.norm(along, axis=1), LEAST_PX)[:, None]
    rim_normal *= -np.sign(np.sum((pixels[third] - start) * rim_normal, axis=1))[:, None]
    drawn = _outermost(pixels, rim)
    own = _nearest_edge(drawn, start, along)[cKDTree(drawn).query(samples_px)[1]]
    share, foot = _foot(samples_px, start[own], along[own])
    gap = samples_px - foot
    size = np.linalg.norm(gap, axis=1)
    side = np.where(np.sum(gap * rim_normal[own], axis=1) < 0.0, -1.0, 1.0)
    at_corner = ((share <= 0.0) | (share >= 1.0)) & (size > LEAST_PX)
    normal = np.where(at_corner[:, None], side[:, None] * gap / np.maximum(size, LEAST_PX)[:, None], rim_normal[own])
    first, second = rim[own].T
    point = cam[first] * (1.0 - share)[:, None] + cam[second] * share[:, None]
    return Contact(first, second, share, point, normal, side * size)


def _contour_generator(surface: StarSurface, pixels: Array) -> tuple[Index, Index]:
    """Ends (r, 2) of the edges between a face that is seen and one that is not, and the third corner (r,) of the seen one."""
    mesh = surface.sphere
    (a, b, c), x, y = mesh.faces.T, pixels[:, 0], pixels[:, 1]
    seen = (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]) > 0.0
    rim = np.flatnonzero(seen[mesh.beside[:, 0]] != seen[mesh.beside[:, 1]])
    ends, beside = mesh.ends[rim], mesh.beside[rim]
    face = np.where(seen[beside[:, 0]], beside[:, 0], beside[:, 1])
    return ends, mesh.faces[face].sum(axis=1) - ends.sum(axis=1)


def _outermost(pixels: Array, rim: Index) -> Array:
    """The outer boundary (d, 2) px of the drawn edges."""
    finer = int(np.clip(DRAWN_PX / np.ptp(pixels, axis=0).max(), COARSEST, FINEST))
    corner = pixels.min(axis=0) - MARGIN_PX
    width, height = np.ceil((pixels.max(axis=0) + MARGIN_PX - corner) * finer).astype(int)
    drawn = np.zeros((height, width), np.uint8)
    cv2.polylines(drawn, np.round((pixels[rim] - corner) * finer).astype(np.int32), isClosed=False, color=255)
    contours, _ = cv2.findContours(drawn, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.asarray(max(contours, key=cv2.contourArea)[:, 0] / finer + corner)


def _nearest_edge(points: Array, start: Array, along: Array) -> Index:
    """Number (d,) of the edge nearest to each of ``points`` (d, 2), of those whose middles are."""
    near = cKDTree(start + 0.5 * along).query(points, k=min(NEAREST, len(start)))[1].reshape(len(points), -1)
    _, foot = _foot(points[:, None], start[near], along[near])
    apart = np.sum((points[:, None] - foot) ** 2, axis=-1)
    return np.asarray(near[np.arange(len(points)), apart.argmin(axis=1)])


def _foot(points: Array, start: Array, along: Array) -> tuple[Array, Array]:
    """Share of the way along segments at which they are nearest to points, and the place there."""
    length2 = np.maximum(np.sum(along**2, axis=-1), LEAST_PX**2)
    share = np.clip(np.sum((points - start) * along, axis=-1) / length2, 0.0, 1.0)
    return share, start + share[..., None] * along
