"""The outline that a mesh casts in a picture, hollows between its spikes included.

Edges between a face that looks at the camera and one that looks away are the mesh's contour generator; the outer boundary of their picture
is the outline [Cipolla and Giblin, Visual Motion of Curves and Surfaces, 2000]. They are drawn finer than the pixels. Of the
convex outline, which the projected corners give exactly, hollows deeper than a quarter of a pixel are cut out; shallower ones are the
roughness of a carved hull.
"""

from dataclasses import dataclass

import cv2
import numba
import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.closed_curves import largest_part, unit_circle

Array = NDArray[np.float64]
FINER = 16
"""How much finer than its pixels an outline is drawn: a sixteenth is below what noise leaves."""
MARGIN_PX = 2.0
"""Of a drawing around an outline."""
SHALLOW_PX = 0.25
"""Depth of a hollow that is none (notebook 12)."""
SIMPLER_PX = 0.05
"""How far a drawn outline may be simplified: below its drawing's own pixels."""
OPENED_PX = 1e-6
"""What rounding may leave of the convex outline's edge over a hollow, which would close it (notebook 28)."""
DIRECTIONS, FEWEST_CORNERS = 180, 3
"""Directions, every two degrees, over which a cast outline is compared with a seen one; corners below which an outline has no area."""
SLACK_PX = 0.3
"""Depth by which a hollow is told from noise of the outline that shows it (notebook 26)."""


@dataclass(frozen=True)
class CastingMesh:
    """A mesh in the particle frame.

    ``vertices`` (v, 3) m, ``faces`` (f, 3), and of every edge its ``ends`` (e, 2) and the two faces ``beside`` it (e, 2).
    """

    vertices: Array
    faces: NDArray[np.int64]
    ends: NDArray[np.int64]
    beside: NDArray[np.int64]


def casting_mesh(mesh: SurfaceMesh) -> CastingMesh:
    """The mesh with its edges; faces turn the same way round."""
    import trimesh  # noqa: PLC0415 - loads networkx: 0.15 s, of no use to trajectories

    known = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    return CastingMesh(mesh.vertices, mesh.faces, np.asarray(known.face_adjacency_edges), np.asarray(known.face_adjacency))


def cast_outline(mesh: CastingMesh, camera: Intrinsics, R_cam_particle: Array, t_cam_particle: Array, *, finer: int = FINER) -> Array:
    """The outline (n, 2) px of the mesh, its largest part where it falls apart; hollows that are shallow are filled.

    The contour generator is drawn ``finer`` times finer than the pixels.
    ``R_cam_particle`` (3, 3), ``t_cam_particle`` (3,) m.
    """
    pixels = camera.project(mesh.vertices @ R_cam_particle.T + t_cam_particle)
    rim = mesh.ends[contour_generator(mesh, pixels)]
    corners = _hull_corners(mesh, pixels, rim)
    drawn = drawn_rim(pixels, rim, finer)
    if len(drawn) < FEWEST_CORNERS:  # seen edge on
        return corners
    rest = shapely.Polygon(corners).difference(_hollows(drawn, corners).buffer(OPENED_PX, join_style="mitre"))
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
    """The outline (n, 2) px of the convex body with ``vertices`` (v, 3) m; ``R_cam_particle`` (3, 3), ``t_cam_particle`` (3,) m."""
    pixels = camera.project(vertices @ R_cam_particle.T + t_cam_particle)
    return np.asarray(pixels[ConvexHull(pixels).vertices])


def contour_generator(mesh: CastingMesh, pixels: Array) -> NDArray[np.int64]:
    """Numbers (r,) of the edges between a face that looks at the camera and one that looks away; ``pixels`` (v, 2) of the vertices."""
    return np.flatnonzero(_on_rim(np.ascontiguousarray(pixels), mesh.faces, mesh.beside))


def drawn_rim(pixels: Array, rim: NDArray[np.int64], finer: int) -> Array:
    """The outer boundary (n, 2) px of the contour generator's edges ``rim`` (e, 2), drawn ``finer`` times finer than the pixels.

    ``pixels`` (v, 2) of the vertices.
    """
    drawn, corner = _blank(pixels[rim], finer)
    _draw(drawn, np.round((pixels[rim] - corner) * finer).astype(np.int64), np.full(len(rim), 255, dtype=np.uint8))
    return _outer(drawn, cv2.CHAIN_APPROX_SIMPLE) / finer + corner


def _blank(lines: Array, finer: int) -> tuple[NDArray[np.uint8], Array]:
    """An empty drawing that holds all ``lines`` (e, 2, 2) px, and where its corner is (2,)."""
    along = lines.reshape(-1, 2).T.copy()  # each axis by itself: numpy takes ten times as long over both
    corner = np.array([each.min() for each in along]) - MARGIN_PX
    width, height = np.ceil((np.array([each.max() for each in along]) + MARGIN_PX - corner) * finer).astype(int)
    return np.zeros((height, width), np.uint8), corner


def _outer(drawn: NDArray[np.integer], chain: int) -> NDArray[np.int64]:
    """The boundary (n, 2) around most of what is drawn."""
    contours, _ = cv2.findContours(drawn, cv2.RETR_EXTERNAL, chain)
    return np.asarray(max(contours, key=cv2.contourArea)[:, 0], dtype=np.int64)


def _hull_corners(mesh: CastingMesh, pixels: Array, rim: NDArray[np.int64]) -> Array:
    """The corners (c, 2) px of the convex outline: the contour generator of a closed mesh holds them all, and is much smaller than it."""
    if 2 * len(mesh.ends) == 3 * len(mesh.faces):
        held = np.zeros(len(pixels), dtype=np.bool_)
        held[rim] = True
        pixels = pixels[held]
    return np.asarray(pixels[ConvexHull(pixels).vertices])


def _hollows(drawn: Array, corners: Array) -> shapely.Geometry:
    """What the ``drawn`` rim (n, 2) px leaves of the convex outline, where it is deeper than ``SHALLOW_PX``.

    No hollow is deeper than the rim's points.
    """
    if _depths_px(drawn, corners).max() <= SHALLOW_PX:
        return shapely.Polygon()
    pockets = shapely.get_parts(shapely.Polygon(corners).difference(shapely.Polygon(drawn).buffer(0.0).simplify(SIMPLER_PX)))
    points, pocket = shapely.get_coordinates(pockets, return_index=True)
    return shapely.union_all(pockets[np.unique(pocket[_depths_px(points, corners) > SHALLOW_PX])])


def _depths_px(points: Array, corners: Array) -> Array:
    """How far (n,) px points (n, 2) lie inside the convex outline with ``corners`` (c, 2): within the nearest of its sides."""
    side = np.roll(corners, -1, axis=0) - corners
    normal = np.column_stack([side[:, 1], -side[:, 0]]) / np.linalg.norm(side, axis=1)[:, None]
    return np.asarray((np.sum(corners * normal, axis=1) - points @ normal.T).min(axis=1))


@numba.njit(cache=True)
def _on_rim(pixels, faces, beside):  # type: ignore[no-untyped-def]
    """Edges (e,) between a face that looks at the camera and one that looks away."""
    seen, rim = np.empty(len(faces), np.bool_), np.empty(len(beside), np.bool_)
    for f in range(len(faces)):
        a, b, c = pixels[faces[f, 0]], pixels[faces[f, 1]], pixels[faces[f, 2]]
        seen[f] = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
    for e in range(len(beside)):
        rim[e] = seen[beside[e, 0]] != seen[beside[e, 1]]
    return rim


@numba.njit(cache=True)
def boundary(picture, pixels, corner, finer):  # type: ignore[no-untyped-def]
    """Every point (n, 2) px of the outer boundary of edges with ends ``pixels`` (e, 2, 2), as :func:`drawn_rim` draws it.

    And which edge is drawn there (n,). ``picture`` to draw on, ``finer`` than the pixels, is empty before and after; its first pixel is at
    the ``corner`` (2,) px.
    """
    lines, numbers = np.empty(pixels.shape, np.int64), np.arange(1, len(pixels) + 1)
    for e in range(len(pixels)):
        for end in range(2):
            for axis in range(2):
                lines[e, end, axis] = np.rint((pixels[e, end, axis] - corner[axis]) * finer)
    _draw(picture, lines, numbers)
    outer = _traced(picture, lines[:, :, 1].min())
    points, edge = outer / finer + corner, np.empty(len(outer), np.int64)
    for i in range(len(outer)):
        edge[i] = picture[outer[i, 1], outer[i, 0]] - 1
    _draw(picture, lines, np.zeros_like(numbers))
    return points, edge


@numba.njit(cache=True)
def _traced(picture, y):  # type: ignore[no-untyped-def]
    """The border (n, 2) around what is drawn, in one piece and not at the picture's edge, from its first pixel on, in row ``y``.

    As OpenCV follows it [Suzuki and Abe, CVGIP 30 (1985) 32], which scans the whole picture first.
    """
    step = np.array([[1, 0], [1, -1], [0, -1], [-1, -1], [-1, 0], [-1, 1], [0, 1], [1, 1]])
    x, side = 0, 3
    while picture[y, x] == 0:
        x += 1
    first_x, first_y = x, y
    while picture[y + step[side, 1], x + step[side, 0]] == 0:
        side = (side - 1) % 8
        if side == 4:  # a single point
            return np.array([[x, y]])
    last_x, last_y = x + step[side, 0], y + step[side, 1]
    found, count = np.empty((1024, 2), np.int64), 0
    while True:
        side = (side + 1) % 8
        while picture[y + step[side, 1], x + step[side, 0]] == 0:
            side = (side + 1) % 8
        if count == len(found):
            found = np.concatenate((found, np.empty_like(found)))
        found[count, 0], found[count, 1] = x, y
        count += 1
        next_x, next_y = x + step[side, 0], y + step[side, 1]
        if next_x == first_x and next_y == first_y and x == last_x and y == last_y:
            return found[:count]
        x, y, side = next_x, next_y, (side + 4) % 8


@numba.njit(cache=True)
def _draw(picture, lines, values):  # type: ignore[no-untyped-def]
    """Draw lines (n, 2, 2) with ``values`` (n,) as OpenCV does, which takes longer to read so many short ones than to draw them."""
    for i in range(len(lines)):
        x, y, x1, y1 = lines[i, 0, 0], lines[i, 0, 1], lines[i, 1, 0], lines[i, 1, 1]
        if x1 < x:
            x, y, x1, y1 = x1, y1, x, y
        along, across, up = x1 - x, abs(y1 - y), 1 if y1 >= y else -1
        steep = across > along
        if steep:
            along, across = across, along
        left = along - 2 * across
        for _ in range(along + 1):
            picture[y, x] = values[i]
            both = left < 0
            left += 2 * along * both - 2 * across
            x += 1 if both or not steep else 0
            y += up if both or steep else 0
