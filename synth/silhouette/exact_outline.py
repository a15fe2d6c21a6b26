"""The exact outline of a triangle mesh seen by a calibrated camera.

A point of the silhouette's boundary lies on a contour edge: an edge between a face that the camera centre sees and one that
it does not. Seen from the camera a face is front-facing when its projection has one sign of area, so both the test and the
projection need ideal image coordinates only. The contour edges, noded against each other, cut the plane into regions; the
outline is the outer ring of the union of all bounded regions (:mod:`synth.silhouette.outer_ring`), so that holes count as filled.
Straight edges stay straight under the ideal projection; with lens distortion they bend, and the ring is subdivided before it is
distorted (chords of at most ``MAX_CHORD_PX``, an error below 1e-5 px for moderate lenses).

Valid for closed, consistently oriented meshes that lie wholly in front of the camera.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
import shapely
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import oriented
from synth.silhouette.outer_ring import outer_ring

Array = NDArray[np.float64]

MAX_CHORD_PX = 1.0


@dataclass(frozen=True)
class OutlineMesh:
    """A closed mesh with its edges: ``edges`` (e, 2) vertex pairs and ``edge_faces`` (e, 2) the faces on either side."""

    vertices: Float[NDArray[np.float64], "v 3"]
    faces: NDArray[np.int64]
    edges: NDArray[np.int64]
    edge_faces: NDArray[np.int64]


def outline_mesh(vertices: Float[NDArray[np.float64], "v 3"], faces: NDArray[np.int64]) -> OutlineMesh:
    """Find the edges of a closed mesh once, for any number of outlines."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return OutlineMesh(
        np.asarray(vertices, dtype=np.float64),
        np.asarray(faces, dtype=np.int64),
        np.asarray(mesh.face_adjacency_edges, dtype=np.int64),
        np.asarray(mesh.face_adjacency, dtype=np.int64),
    )


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
    points_cam = mesh.vertices @ R_cam_particle.T + t_cam_particle
    if points_cam[:, 2].min() <= 0:
        raise ValueError(f"the mesh must lie in front of the camera; its nearest vertex has z = {points_cam[:, 2].min():.4g} m")
    ideal = points_cam[:, :2] / points_cam[:, 2:] * [intrinsics.fx_px, intrinsics.fy_px]
    ring = outer_ring(contour_segments(mesh, ideal))
    if any(intrinsics.distortion):
        ring = _subdivided(ring)
    return oriented(intrinsics.distort(ring / [intrinsics.fx_px, intrinsics.fy_px]))


def contour_segments(mesh: OutlineMesh, projected: Float[NDArray[np.float64], "v 2"]) -> Float[NDArray[np.float64], "s 2 2"]:
    """The contour edges' projections; ``projected`` are the vertices in ideal image coordinates (any scale)."""
    return projected[contour_edges(mesh, projected)]


def contour_edges(mesh: OutlineMesh, projected: Float[NDArray[np.float64], "v 2"]) -> NDArray[np.int64]:
    """The contour edges as pairs (s, 2) of vertices; ``projected`` are all vertices in ideal image coordinates (any scale)."""
    x, y = (np.ascontiguousarray(projected[:, axis])[mesh.faces.T] for axis in (0, 1))
    seen = (x[1] - x[0]) * (y[2] - y[0]) < (y[1] - y[0]) * (x[2] - x[0])
    contour = seen[mesh.edge_faces[:, 0]] != seen[mesh.edge_faces[:, 1]]
    return mesh.edges[contour]


def _subdivided(ring: Array) -> Array:
    closed = shapely.segmentize(shapely.linearrings(ring), MAX_CHORD_PX)
    return cast(Array, shapely.get_coordinates(closed)[:-1])
