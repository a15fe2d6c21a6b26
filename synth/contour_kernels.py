"""Compiled loops over the contour edges of a mesh, for :mod:`synth.silhouette`.

They lie outside of that package, whose functions are wrapped in tests to check shapes: what is wrapped is not compiled.
"""

import numba
import numpy as np

LEAST_SQUARE = 1e-300
"""Of a segment's length: what is shorter is a point."""


@numba.njit(cache=True)
def between_seen_and_unseen(faces, edges, edge_faces, projected):  # type: ignore[no-untyped-def]
    """Edges (s, 2) between a face that is seen and one that is not, as they run in the one that is."""
    seen, found, count = np.empty(len(faces), np.bool_), np.empty_like(edges), 0
    for f in range(len(faces)):
        a, b, c = projected[faces[f, 0]], projected[faces[f, 1]], projected[faces[f, 2]]
        seen[f] = (b[0] - a[0]) * (c[1] - a[1]) < (b[1] - a[1]) * (c[0] - a[0])
    for e in range(len(edges)):
        first = seen[edge_faces[e, 0]]
        if first != seen[edge_faces[e, 1]]:
            found[count, 0], found[count, 1] = (edges[e, 0], edges[e, 1]) if first else (edges[e, 1], edges[e, 0])
            count += 1
    return found[:count].copy()


@numba.njit(cache=True)
def loops(edges):  # type: ignore[no-untyped-def]
    """Numbers (s,) of directed ``edges`` (s, 2) in the order of closed loops, and where each of these begins, and the last ends."""
    leaving, also = np.full(edges.max() + 1, -1), np.empty(len(edges), np.int64)
    for edge in range(len(edges)):
        also[edge], leaving[edges[edge, 0]] = leaving[edges[edge, 0]], edge
    order, begins, placed, loops = np.empty(len(edges), np.int64), np.zeros(len(edges) + 1, np.int64), 0, 0
    done = np.zeros(len(edges), np.bool_)
    for first in range(len(edges)):
        edge = first
        while not done[edge]:
            order[placed], done[edge] = edge, True
            placed += 1
            end = edges[edge, 1]
            edge = leaving[end]
            leaving[end] = also[edge]
        if begins[loops] < placed:
            loops += 1
            begins[loops] = placed
    return order, begins[: loops + 1]


@numba.njit(cache=True)
def nearest_segments(points, segments):  # type: ignore[no-untyped-def]
    """Which of ``segments`` (s, 2, 2) is nearest to each of ``points`` (m, 2), and the share (m,) of the way along it."""
    nearest, share = np.empty(len(points), np.int64), np.empty(len(points))
    start, along = segments[:, 0].copy(), segments[:, 1] - segments[:, 0]
    square = np.maximum(np.sum(along**2, axis=1), LEAST_SQUARE)
    for k in range(len(points)):
        least = np.inf
        for e in range(len(segments)):
            x, y = points[k, 0] - start[e, 0], points[k, 1] - start[e, 1]
            t = min(max((x * along[e, 0] + y * along[e, 1]) / square[e], 0.0), 1.0)
            apart = (x - t * along[e, 0]) ** 2 + (y - t * along[e, 1]) ** 2
            if apart < least:
                least, nearest[k], share[k] = apart, e, t
    return nearest, share
