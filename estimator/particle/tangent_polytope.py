"""The convex polytope that all tangent planes of the calibrated views cut out: the convex visual hull, with its corners sharp.

Every edge of a view's hull, seen from the camera's centre, spans a plane that touches the body; the body lies in the intersection of
their half spaces [Laurentini 1994]. A voxel hull rounds corners by about a voxel, and how an outline's noise and smoothing bias its
tangents depends on just those corners. Concavities are not seen; the polytope grows with the views' bias and shrinks with their noise.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial import HalfspaceIntersection, QhullError

from datasets.errors import InputError
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import Silhouettes

Array = NDArray[np.float64]
LATTICE = 2e-4
"""Vertices nearer than this share of the body's extent count once: far below what an outline's pixel sees."""


def tangent_polytope(seen: Silhouettes, poses: PoseSet, inside: Float[NDArray[np.float64], "3"]) -> Float[NDArray[np.float64], "v 3"]:
    """Vertices (m, particle frame) of the polytope around ``inside`` (m, particle frame), a point within the body.

    Raises
    ------
    InputError
        Where the tangent planes leave nothing around ``inside``, or do not bound it.
    """
    planes = np.concatenate([_tangent_planes(seen.xy[seen.slice_of(k)], poses.R[k], poses.t[k], inside) for k in range(len(seen))])
    distance = -(planes[:, :3] @ inside + planes[:, 3])
    size = float(np.median(distance))
    if size <= 0.0 or distance.min() <= 0.0:
        raise InputError("calibrated views: expected tangent planes that leave room for the body's middle, got none; a view may not belong")
    scaled = np.column_stack([planes[:, :3], -distance / size])
    try:
        vertices = HalfspaceIntersection(scaled, np.zeros(3)).intersections
    except QhullError as error:
        raise InputError(f"calibrated views: expected tangent planes that bound a body, got {error}") from error
    vertices = vertices[np.isfinite(vertices).all(axis=1)]
    _, first = np.unique(np.round(vertices / LATTICE).astype(np.int64), axis=0, return_index=True)
    return np.asarray(vertices[np.sort(first)] * size + inside)


def _tangent_planes(xy: Array, R: Array, t: Array, inside: Array) -> Array:
    """Planes (e, 4), particle frame, through a camera's centre and the edges of a hull (v, 2): ``n x + d <= 0`` within the body."""
    ray = np.column_stack([xy, np.ones(len(xy))])
    normal = np.cross(ray, np.roll(ray, -1, axis=0))
    length = np.linalg.norm(normal, axis=1)
    normal = normal[length > 0.0] / length[length > 0.0, None]
    outward = -np.sign(np.median(normal @ (R @ inside + t)))
    return np.asarray(outward * np.column_stack([normal @ R, normal @ t]))
