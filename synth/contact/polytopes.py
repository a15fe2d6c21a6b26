"""Convex polytopes that may touch one another: their features, and the signed gap between two of them.

Two convex bodies are apart exactly where one of a finite number of directions separates them: a face normal of either, or the common
normal of two edges that are neighbours on the Minkowski difference [Gregorius, Game Developers Conference 2013: the arcs of the edges'
normals cross on the unit sphere]. The largest separation over all of them is the signed gap: above zero the bodies are apart, below it is
minus the depth of penetration. It is continuous in the poses, so the time of first touch is its root.

A body that is not convex is taken by its convex hull.
"""

from typing import NamedTuple

import numba
import numpy as np
import trimesh
from numpy.typing import NDArray

from datasets.errors import InputError
from synth.contact.touching import places_of
from synth.effects.links import FlyingBody

Array = NDArray[np.float64]

FLAT_COSINE = 1 - 1e-9
"""Of the angle between two faces that are one."""
MOST_EDGES = 8000
CORNER_ON_FACE, FACE_ON_CORNER, EDGES = 0, 1, 2
"""Kinds of contact: corner of the first on a face of the second, the other way round, edge on edge."""


class Polytope(NamedTuple):
    """A convex polytope in body axes about the centre of mass (m).

    ``vertices`` (v, 3); faces by outward unit ``normals`` (f, 3), ``offsets`` (f,), ``n.x = offset``, and unit ``tangents`` (f, 3) along
    them; edges by their vertices ``ends`` (e, 2) and the outward normals of the faces on either side, ``sides`` (e, 2, 3).
    """

    vertices: Array
    normals: Array
    offsets: Array
    tangents: Array
    ends: NDArray[np.int64]
    sides: Array


def polytope_of(body: FlyingBody) -> Polytope:
    """The convex hull of a body.

    Raises
    ------
    InputError
        Where it has so many edges that it is a smooth body's.
    """
    places = places_of(body)
    size = float(np.abs(places).max())
    hull = trimesh.convex.convex_hull(places / size)
    vertices, normals = np.array(hull.vertices) * size, np.array(hull.face_normals)
    pairs, ends = np.array(hull.face_adjacency), np.array(hull.face_adjacency_edges, dtype=np.int64)
    bent = np.einsum("ei,ei->e", normals[pairs[:, 0]], normals[pairs[:, 1]]) < FLAT_COSINE
    if bent.sum() > MOST_EDGES:
        raise InputError(
            f"pair: expected bodies with at most {MOST_EDGES} edges of their convex hulls, got {bent.sum()}; use a coarser mesh."
        )
    planes = _merged(normals, np.array(hull.faces), pairs[~bent])
    tangents = np.cross(normals[planes], np.eye(3)[np.argmin(np.abs(normals[planes]), axis=1)])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    offsets = np.einsum("fi,fi->f", normals[planes], vertices[np.array(hull.faces)[planes, 0]])
    return Polytope(vertices, normals[planes], offsets, tangents, ends[bent], normals[pairs[bent]])


def _merged(normals: Array, faces: NDArray[np.int64], flat: NDArray[np.int64]) -> NDArray[np.int64]:
    """One triangle of each flat face."""
    groups = trimesh.graph.connected_components(flat, nodes=np.arange(len(faces)), min_len=1)
    return np.array(sorted(int(min(group)) for group in groups), dtype=np.int64)


@numba.njit(cache=True)
def signed_gap(A, RA, xA, B, RB, xB):  # type: ignore[no-untyped-def] # noqa: PLR0917
    """The gap (m) of two polytopes with poses ``R``, ``x``, the kind of features it is between, and their numbers."""
    best, kind, first, second = -1e300, 0, 0, 0
    va, vb = A.vertices @ RA.T + xA, B.vertices @ RB.T + xB
    for which in range(2):
        corners, faces, R, x = (va, B, RB, xB) if which == 0 else (vb, A, RA, xA)
        local = (corners - x) @ R
        for k in range(len(faces.offsets)):
            lowest, at = 1e300, 0
            for i in range(len(local)):
                height = faces.normals[k, 0] * local[i, 0] + faces.normals[k, 1] * local[i, 1] + faces.normals[k, 2] * local[i, 2]
                if height < lowest:
                    lowest, at = height, i
            if lowest - faces.offsets[k] > best:
                best, kind = lowest - faces.offsets[k], which
                first, second = (at, k) if which == 0 else (k, at)
    across = RB.T @ RA
    for i in range(len(A.ends)):
        a, b = across @ A.sides[i, 0], across @ A.sides[i, 1]
        pa, da = va[A.ends[i, 0]], va[A.ends[i, 1]] - va[A.ends[i, 0]]
        ab = np.cross(b, a)
        for j in range(len(B.ends)):
            if not arcs_cross(a, b, ab, B.sides[j, 0], B.sides[j, 1]):
                continue
            pb, db = vb[B.ends[j, 0]], vb[B.ends[j, 1]] - vb[B.ends[j, 0]]
            n = np.cross(da, db)
            size = np.sqrt(n @ n)
            if size < 1e-12 * np.sqrt(da @ da) * np.sqrt(db @ db):
                continue
            n = n / size
            if n @ (RB @ (B.sides[j, 0] + B.sides[j, 1])) < 0:
                n = -n
            gap = n @ (pa - pb)
            if gap > best:
                best, kind, first, second = gap, 2, i, j
    return best, kind, first, second


@numba.njit(cache=True)
def arcs_cross(a, b, ab, n1, n2):  # type: ignore[no-untyped-def]
    """Whether the arc of the normals ``a``, ``b`` crosses that of ``-n1``, ``-n2``; ``ab`` is ``b x a``."""
    c1 = -(n1[0] * ab[0] + n1[1] * ab[1] + n1[2] * ab[2])
    d1 = -(n2[0] * ab[0] + n2[1] * ab[1] + n2[2] * ab[2])
    if c1 * d1 >= 0:
        return False
    dc0, dc1, dc2 = n2[1] * n1[2] - n2[2] * n1[1], n2[2] * n1[0] - n2[0] * n1[2], n2[0] * n1[1] - n2[1] * n1[0]
    a1 = a[0] * dc0 + a[1] * dc1 + a[2] * dc2
    b1 = b[0] * dc0 + b[1] * dc1 + b[2] * dc2
    return a1 * b1 < 0 and c1 * b1 > 0
