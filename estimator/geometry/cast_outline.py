"""The outline that a mesh casts in a picture, hollows between its spikes included.

Edges between a face that looks at the camera and one that looks away are the mesh's contour generator; the outer boundary of their picture
is the outline [Cipolla and Giblin, Visual Motion of Curves and Surfaces, 2000]. They are drawn finer than the pixels. Of the
convex outline, which the projected corners give exactly, hollows deeper than a quarter of a pixel are cut out; shallower ones are the
roughness of a carved hull.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import shapely
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.vocabulary.camera import Intrinsics
from estimator.geometry.closed_curves import largest_part, unit_circle
from estimator.geometry.visual_hull import HullMesh

Array = NDArray[np.float64]
FINER = 16
MARGIN_PX = 2.0
SHALLOW_PX = 0.25
"""Depth of a hollow that is none."""
SIMPLER_PX = 0.05
OPENED_PX = 1e-6
"""What rounding may leave of the convex outline's edge over a hollow, which would close it."""
DIRECTIONS, FEWEST_CORNERS = 180, 3
SLACK_PX = 0.3
"""Depth by which a hollow is told from noise of the outline that shows it."""


@dataclass(frozen=True)
class CastingMesh:
    """A mesh's ``vertices`` (v, 3) m, ``faces`` (f, 3), and of every edge its ``ends`` (e, 2) and the two faces ``beside`` it (e, 2)."""

    vertices: Array
    faces: NDArray[np.int64]
    ends: NDArray[np.int64]
    beside: NDArray[np.int64]


def casting_mesh(mesh: HullMesh) -> CastingMesh:
    """The mesh with its edges; faces turn the same way round."""
    known = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    return CastingMesh(mesh.vertices, mesh.faces, np.asarray(known.face_adjacency_edges), np.asarray(known.face_adjacency))


def cast_outline(mesh: CastingMesh, camera: Intrinsics, R_cam_particle: Array, t_cam_particle: Array, *, finer: int = FINER) -> Array:
    """The outline (n, 2) px of the mesh, its largest part where it falls apart; hollows that are shallow are filled.

    The contour generator is drawn ``finer`` times finer than the pixels.
    """
    pixels = camera.project(mesh.vertices @ R_cam_particle.T + t_cam_particle)
    convex = shapely.Polygon(pixels[ConvexHull(pixels).vertices])
    drawn = _drawn_rim(mesh, pixels, finer)
    if len(drawn) < FEWEST_CORNERS:  # seen edge on
        return np.asarray(shapely.get_coordinates(convex.exterior)[:-1])
    rim = shapely.Polygon(drawn)
    pockets = np.array(shapely.get_parts(convex.difference(rim.buffer(0.0).simplify(SIMPLER_PX))))
    hollows = shapely.union_all([p for p in pockets if _depth_px(p, convex) > SHALLOW_PX])
    rest = convex.difference(hollows.buffer(OPENED_PX))
    return np.asarray(shapely.get_coordinates(largest_part(rest).exterior)[:-1])


def with_hollows_seen(cast: Array, seen: Array) -> Array:
    """A ``cast`` outline (n, 2) px without what the ``seen`` one (m, 2) px of the same body shows to be hollow.

    A visual hull fills hollows that no calibrated view looks into, and the picture itself shows some of them: a body lies inside every cone
    of its outlines [Laurentini, IEEE Trans. PAMI 16 (1994) 150]. The seen outline is moved out by as much as tangents of the cast one lie
    beyond it at most, so that neither a pose that is off nor an effect that moves outlines cuts anything of a corner: of a pocket so much
    stays, too. What is then shallower than ``SLACK_PX`` is noise.
    """
    if min(len(cast), len(seen)) < FEWEST_CORNERS:
        return cast
    u = unit_circle(DIRECTIONS)
    beyond = max(float(np.max((cast @ u.T).max(axis=0) - (seen @ u.T).max(axis=0))), 0.0)
    body = shapely.Polygon(cast).buffer(0.0)
    pockets = body.difference(shapely.make_valid(shapely.Polygon(seen)).buffer(beyond + SLACK_PX))
    left = body.difference(pockets.buffer(SLACK_PX))
    if left.is_empty:
        return cast
    return np.asarray(shapely.get_coordinates(largest_part(left).simplify(SIMPLER_PX).exterior)[:-1])


def cast_convex(vertices: Array, camera: Intrinsics, R_cam_particle: Array, t_cam_particle: Array) -> Array:
    """The outline (n, 2) px of the convex body with ``vertices`` (v, 3) m."""
    pixels = camera.project(vertices @ R_cam_particle.T + t_cam_particle)
    return np.asarray(pixels[ConvexHull(pixels).vertices])


def _depth_px(pocket: shapely.Polygon, convex: shapely.Polygon) -> float:
    """How far a hollow reaches in from the convex outline."""
    return float(shapely.distance(shapely.points(shapely.get_coordinates(pocket)), convex.exterior).max())


def _drawn_rim(mesh: CastingMesh, pixels: Array, finer: int) -> Array:
    """The outer boundary (n, 2) px of the drawn contour generator."""
    corner = pixels.min(axis=0) - MARGIN_PX
    (a, b, c), x, y = mesh.faces.T, pixels[:, 0], pixels[:, 1]
    seen = (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]) > 0.0
    rim = mesh.ends[seen[mesh.beside[:, 0]] != seen[mesh.beside[:, 1]]]
    width, height = np.ceil((pixels.max(axis=0) + MARGIN_PX - corner) * finer).astype(int)
    drawn = np.zeros((height, width), np.uint8)
    cv2.polylines(drawn, np.round((pixels[rim] - corner) * finer).astype(np.int32), isClosed=False, color=255)
    contours, _ = cv2.findContours(drawn, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return np.asarray(max(contours, key=cv2.contourArea)[:, 0] / finer + corner)
