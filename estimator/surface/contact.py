"""Where the samples of a seen outline lie beside the outline that a surface casts.

The outline of a mesh is the outer boundary of its contour generator: the edges between a face that looks at the camera and one that looks
away [Cipolla and Giblin, Visual Motion of Curves and Surfaces, 2000]. It is drawn finer than the pixels, every edge with its
number, to learn which of those edges is outermost where; distances are to the edges themselves.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from datasets.vocabulary.camera import Intrinsics
from estimator.geometry.cast_outline import FINER, contour_generator, drawn_edges
from estimator.geometry.closed_curves import area
from estimator.motion.rigid_body import RanAway
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DRAWN_PX, COARSEST = 900, 4
"""Size of the drawing, and how much finer than the pixels it is at least."""
LEAST_PX = 1e-9
"""What rounding leaves of a length that is none."""


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


def contact_of(surface: Surface, camera: Intrinsics, R_cam_particle: Array, t_cam_particle: Array, samples_px: Array) -> Contact:
    """What samples of an outline meet of a surface at a pose.

    ``R_cam_particle`` (3, 3) and ``t_cam_particle`` (3,) m: from the particle's frame to the camera's; ``samples_px`` (s, 2).

    Raises
    ------
    RanAway
        Where corners lie behind the camera, or the surface is larger than its picture.
    """
    cam = surface.vertices @ R_cam_particle.T + t_cam_particle
    if not np.all(cam[:, 2] > 0.0):
        raise RanAway("a surface ran away behind the camera")
    pixels = camera.project(cam)
    if not np.ptp(pixels, axis=0).max() <= camera.width_px + camera.height_px:
        raise RanAway("a surface ran away out of the picture")
    mesh = surface.sphere.mesh
    edges = contour_generator(mesh, pixels)
    rim = mesh.ends[edges]
    start = pixels[rim[:, 0]]
    along = pixels[rim[:, 1]] - start
    finer = int(np.clip(DRAWN_PX / max(np.ptp(start[:, 0]), np.ptp(start[:, 1])), COARSEST, FINER))
    drawn, edge = drawn_edges(pixels, rim, finer)
    nearest = cKDTree(drawn, compact_nodes=False, balanced_tree=False).query(samples_px)[1]
    own, outward = edge[nearest], _outward(drawn, finer)[nearest]
    share, foot = _foot(samples_px, start[own], along[own])
    gap = samples_px - foot
    size = np.linalg.norm(gap, axis=1)
    side = np.where(np.sum(gap * outward, axis=1) < 0.0, -1.0, 1.0)
    across = np.column_stack([along[own, 1], -along[own, 0]]) / np.maximum(np.linalg.norm(along[own], axis=1), LEAST_PX)[:, None]
    across *= np.where(np.sum(across * outward, axis=1) < 0.0, -1.0, 1.0)[:, None]
    at_corner = ((share <= 0.0) | (share >= 1.0)) & (size > LEAST_PX)
    normal = np.where(at_corner[:, None], side[:, None] * gap / np.maximum(size, LEAST_PX)[:, None], across)
    side = np.where(np.sum(gap * normal, axis=1) < 0.0, -1.0, 1.0)
    first, second = rim[own].T
    point = cam[first] * (1.0 - share)[:, None] + cam[second] * share[:, None]
    return Contact(first, second, share, point, normal, side * size)


def _outward(drawn: Array, finer: int) -> Array:
    """Outward normals (n, 2) of a boundary drawn (n, 2) px in order, over a pixel to both sides.

    Those of the edges themselves do not tell: the contour generator of a mesh goes to and fro across the outline.
    """
    chord = np.roll(drawn, -finer, axis=0) - np.roll(drawn, finer, axis=0)
    normal = np.column_stack([chord[:, 1], -chord[:, 0]])
    return normal if area(drawn) > 0.0 else -normal


def _foot(points: Array, start: Array, along: Array) -> tuple[Array, Array]:
    """Share of the way along segments at which they are nearest to points, and the place there."""
    length2 = np.maximum(np.sum(along**2, axis=-1), LEAST_PX**2)
    share = np.clip(np.sum((points - start) * along, axis=-1) / length2, 0.0, 1.0)
    return share, start + share[..., None] * along
