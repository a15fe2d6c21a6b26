"""The outline of a body whose rows are exposed one after the other.

Every vertex is projected at the instant of the row in which it then appears, found by iteration: with ``y(t)`` the row of a vertex and
``d(y)`` the row's delay, ``t <- d(y(t))``, which contracts by line time times speed in rows per second, about 0.01. The contour edges of
this projection enclose the outline, as at a single instant. Edges bend, since the points of an edge belong to different instants; the mesh
is refined until its edges are short enough (below 0.01 px at 300 rad/s and 0.3 us per row for ``LONGEST_EDGE_PX``).

Over the rows that a particle takes its pose changes little; vertices are interpolated in time by a cubic through four instants.
"""

from collections.abc import Callable

import numpy as np
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import oriented
from synth.effects import EffectsInForce
from synth.silhouette import OutlineMesh, contour_edges, outline_mesh
from synth.silhouette.outer_ring import outer_ring

Array = NDArray[np.float64]
PointsAt = Callable[[Array], Array]
"""Vertices (instant, vertex, 3) m in the camera frame at instants (instant,) s against the frame's time."""

LONGEST_EDGE_PX = 16.0
ITERATIONS = 6
NODES = np.cos(np.pi * (np.arange(4) + 0.5) / 4)
"""Chebyshev's on [-1, 1]."""


def refined(mesh: OutlineMesh, longest_edge_m: float) -> OutlineMesh:
    """The same surface with every triangle cut into four until no edge is longer than ``longest_edge_m``."""
    vertices, faces = mesh.vertices, mesh.faces
    while np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2).max() > longest_edge_m:
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    return mesh if faces is mesh.faces else outline_mesh(vertices, faces)


def row_by_row_outline(
    mesh: OutlineMesh, camera: Intrinsics, points_at: PointsAt, effects: EffectsInForce, stamp_s: float
) -> Float[NDArray[np.float64], "n 2"]:
    """The outline (px) in the picture whose middle row is exposed at ``stamp_s`` (s after the first frame's time stamp)."""
    delays = effects.row_delays_s(camera.project(points_at(np.zeros(1))[0])[:, 1], camera)
    reach = max(1.1 * float(np.ptp(delays)) / 2, 1e-9)
    nodes = (delays.max() + delays.min()) / 2 + reach * NODES
    known = points_at(nodes)
    for _ in range(ITERATIONS):
        px = _pictured(camera, np.einsum("kv,kvc->vc", _weights(nodes, delays), known), effects, stamp_s + delays)
        delays = effects.row_delays_s(px[:, 1], camera)
    return oriented(outer_ring(px, contour_edges(mesh, px)))


def _pictured(camera: Intrinsics, points_cam: Array, effects: EffectsInForce, stamps_s: Array) -> Array:
    """Pixels of points, each in the picture as it is shifted at its own instant."""
    sway, centre = effects.sway(stamps_s), np.array([camera.cx_px, camera.cy_px])
    return np.asarray(centre + sway.scale[:, None] * (camera.project(points_cam) - centre) + sway.shift_px)


def _weights(nodes: Array, instants: Array) -> Array:
    """Lagrange's weights (node, instant) of polynomial interpolation."""
    return np.array(
        [np.prod([(instants - other) / (node - other) for j, other in enumerate(nodes) if j != k], axis=0) for k, node in enumerate(nodes)]
    )
