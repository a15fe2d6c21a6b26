"""The exact outline of a triangle mesh seen by a calibrated camera.

A point of the silhouette's boundary lies on a contour edge: an edge between a face that the camera centre sees and one that
it does not. Seen from the camera a face is front-facing when its projection has one sign of area, so both the test and the
projection need ideal image coordinates only. The outline is the outer ring of what the contour edges, along their front faces, wind
round (:mod:`synth.silhouette.outer_ring`), so that holes count as filled.
Straight edges stay straight under the ideal projection; with lens distortion they bend, and the ring is subdivided before it is
distorted (chords of at most ``MAX_CHORD_PX``, an error below 1e-5 px for moderate lenses).

Valid for closed, consistently oriented meshes that lie wholly in front of the camera.
"""

from collections import OrderedDict
from dataclasses import dataclass, field
from functools import lru_cache
from typing import cast

import numpy as np
import shapely
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import oriented
from synth.contour_kernels import between_seen_and_unseen
from synth.silhouette.outer_ring import outer_ring

Array = NDArray[np.float64]

MAX_CHORD_PX = 1.0
MOST_MESHES = 4
"""Kept, with their outlines."""
MOST_OUTLINES = 512
"""Kept of a mesh, some 10 kB each: the bound of a flight is that of the outlines that its frames were made with."""


@dataclass(frozen=True)
class OutlineMesh:
    """A closed mesh with its edges: ``edges`` (e, 2) vertex pairs and ``edge_faces`` (e, 2) the faces on either side.

    An edge runs as in its first face, and so against its second. One where four faces meet is two edges.

    ``outlines`` (n, 2) px: the latest ones, by camera and pose.
    """

    vertices: Float[NDArray[np.float64], "v 3"]
    faces: NDArray[np.int64]
    edges: NDArray[np.int64]
    edge_faces: NDArray[np.int64]
    outlines: OrderedDict[tuple[Intrinsics, bytes, bytes], Array] = field(default_factory=OrderedDict, repr=False, compare=False)


def outline_mesh(vertices: Float[NDArray[np.float64], "v 3"], faces: NDArray[np.int64]) -> OutlineMesh:
    """Find the edges of a closed mesh once, for any number of outlines; meshes of the same numbers are one.

    Raises
    ------
    ValueError
        Where the mesh is not closed, or its faces are not oriented consistently.
    """
    return _outline_mesh(np.asarray(vertices, dtype=np.float64).tobytes(), np.asarray(faces, dtype=np.int64).tobytes())


@lru_cache(maxsize=MOST_MESHES)
def _outline_mesh(vertices: bytes, faces: bytes) -> OutlineMesh:
    points, triangles = np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(faces, dtype=np.int64).reshape(-1, 3)
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    up, down = np.flatnonzero(sides[:, 0] < sides[:, 1]), np.flatnonzero(sides[:, 0] >= sides[:, 1])
    up, down = up[np.lexsort(sides[up].T)], down[np.lexsort(sides[down, ::-1].T)]
    if not np.array_equal(sides[up], sides[down, ::-1]):
        raise ValueError("expected a closed mesh with consistently oriented faces, got one with a face's side that no other face runs back")
    return OutlineMesh(points, triangles, sides[up], np.column_stack([up, down]) // 3)


def exact_outline(
    mesh: OutlineMesh,
    intrinsics: Intrinsics,
    R_cam_particle: Float[NDArray[np.float64], "3 3"],
    t_cam_particle: Float[NDArray[np.float64], "3"],
) -> Float[NDArray[np.float64], "n 2"]:
    """The outline (px, positive shoelace area) of ``mesh`` at ``x_cam = R_cam_particle @ x + t_cam_particle`` (m).

    Raises
    ------
    ValueError
        Where a vertex does not lie in front of the camera.
    """
    seen = (intrinsics, R_cam_particle.tobytes(), t_cam_particle.tobytes())
    if seen not in mesh.outlines:
        mesh.outlines[seen] = _outline(mesh, intrinsics, R_cam_particle, t_cam_particle)
        if len(mesh.outlines) > MOST_OUTLINES:
            mesh.outlines.popitem(last=False)
    return mesh.outlines[seen].copy()


def _outline(mesh: OutlineMesh, intrinsics: Intrinsics, R_cam_particle: Array, t_cam_particle: Array) -> Array:
    points_cam = mesh.vertices @ R_cam_particle.T + t_cam_particle
    if points_cam[:, 2].min() <= 0:
        raise ValueError(f"the mesh must lie in front of the camera; its nearest vertex has z = {points_cam[:, 2].min():.4g} m")
    focal_px = (intrinsics.fx_px, intrinsics.fy_px)
    ideal = np.column_stack([points_cam[:, axis] / points_cam[:, 2] * focal_px[axis] for axis in (0, 1)])
    ring = outer_ring(ideal, contour_edges(mesh, ideal))
    if any(intrinsics.distortion):
        ring = _subdivided(ring)
    return oriented(intrinsics.distort(ring / focal_px))


def contour_edges(mesh: OutlineMesh, projected: Float[NDArray[np.float64], "v 2"]) -> NDArray[np.int64]:
    """The contour edges as pairs (s, 2) of vertices, each as it runs in its front face.

    ``projected`` are all vertices in ideal image coordinates (any scale).
    """
    return cast(NDArray[np.int64], between_seen_and_unseen(mesh.faces, mesh.edges, mesh.edge_faces, projected))


def _subdivided(ring: Array) -> Array:
    closed = shapely.segmentize(shapely.linearrings(ring), MAX_CHORD_PX)
    return cast(Array, shapely.get_coordinates(closed)[:-1])
