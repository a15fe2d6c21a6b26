"""Points of a body's surface by their outward normal: where a silhouette's tangent touches the body.

A convex body touches the tangent plane with outward normal ``n`` at the point furthest along ``n``, its support point. The points are
tabled over an octahedral map of the sphere [Cigolle et al. 2014], whose cells are one to three degrees wide: a look-up costs no search.
"""

from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
CELLS = 128
"""Along each side of the map."""
CHUNK = 512
"""Directions that are looked up together: it bounds memory and decides nothing."""


@dataclass(frozen=True)
class Rim:
    """Support points (128 * 128, 3) m of a hull, nominal body axes about the centre of mass, by cell of the octahedral map."""

    points: Array

    def furthest(self, normals: Array) -> Array:
        """Points (..., 3) m of the hull that lie furthest along ``normals`` (..., 3)."""
        return np.asarray(self.points[_cell(normals)])


def rim_of(vertices: Array) -> Rim:
    """The rim of a hull's vertices (v, 3) m, nominal body axes."""
    return _rim(np.ascontiguousarray(vertices, dtype=np.float64).tobytes())


@lru_cache(maxsize=8)
def _rim(packed: bytes) -> Rim:
    """Sequences of one particle ask for the same rim."""
    vertices, directions = np.frombuffer(packed).reshape(-1, 3), _directions()
    parts = (directions[i : i + CHUNK] for i in range(0, len(directions), CHUNK))
    return Rim(vertices[np.concatenate([np.argmax(part @ vertices.T, axis=1) for part in parts])])


def _cell(normals: Array) -> NDArray[np.int64]:
    """Cell (...) of each direction (..., 3) of any length."""
    return np.asarray(_cells(np.ascontiguousarray(normals).reshape(-1, 3)).reshape(normals.shape[:-1]))


@numba.njit(cache=True)
def _cells(normals):  # type: ignore[no-untyped-def]
    cell = np.empty(len(normals), np.int64)
    for i in range(len(normals)):
        x, y, z = normals[i]
        length = max(abs(x) + abs(y) + abs(z), 1e-300)
        x, y = x / length, y / length
        if z < 0.0:
            x, y = (1.0 - abs(y)) * (1.0 if x >= 0.0 else -1.0), (1.0 - abs(x)) * (1.0 if y >= 0.0 else -1.0)
        row, column = int((x + 1.0) * (0.5 * CELLS)), int((y + 1.0) * (0.5 * CELLS))
        cell[i] = min(max(row, 0), CELLS - 1) * CELLS + min(max(column, 0), CELLS - 1)
    return cell


def _directions() -> Array:
    """The middle (128 * 128, 3) of every cell, unit vectors."""
    side = (np.arange(CELLS) + 0.5) * (2.0 / CELLS) - 1.0
    flat = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    z = 1.0 - np.abs(flat).sum(axis=1, keepdims=True)
    folded = (1.0 - np.abs(flat[:, ::-1])) * np.where(flat >= 0.0, 1.0, -1.0)
    directions = np.hstack([np.where(z >= 0.0, flat, folded), z])
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))
