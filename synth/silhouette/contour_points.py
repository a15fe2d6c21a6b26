"""Which points of a body its outline shows, and how the outline moves with the body's pose.

A sample of the outline of a triangle mesh lies on the projection of a contour edge (:mod:`synth.silhouette.exact_outline`). While a
pose changes a little, the edge stays a contour edge, so that the outline moves along its normal as if the point seen were fixed to the
body: the envelope theorem [Cipolla and Giblin, Visual Motion of Curves and Surfaces, 2000, ch. 2]. Where an outline that moves by ``d``
along its normal ``n`` meets the line along which a sample is measured, of direction ``u``, it has moved by ``d / (n u)``. To first
order in the move, and not for samples on steps of the outline that are finer than the sampling.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from synth.contour_kernels import nearest_segments
from synth.silhouette.exact_outline import OutlineMesh, contour_edges

Array = NDArray[np.float64]

LENS_STEP = 1e-6
"""Step in normalised image coordinates of the central differences of a lens: its square, the error, and rounding are both below 1e-9."""
LEAST_COSINE = 0.3
"""Between an outline's normal and the line along which a sample is measured: on a steeper step of a jagged outline (some thousandths of its
samples) the move along that line is without bounds and means nothing. Bounds of flights are the same to two thousandths with 1e-9."""


@dataclass(frozen=True)
class ContourPoints:
    """``points_cam`` (m, 3) m of the body that the samples of an outline show, in camera coordinates.

    ``move_by_point`` (m, 3) px/m: how far the outline moves along each sample's line when its point moves along each axis of the camera.
    """

    points_cam: Float[NDArray[np.float64], "m 3"]
    move_by_point: Float[NDArray[np.float64], "m 3"]


def contour_points(
    mesh: OutlineMesh,
    intrinsics: Intrinsics,
    vertices_cam: Float[NDArray[np.float64], "v 3"],
    samples_px: Float[NDArray[np.float64], "m 2"],
    outward_px: Float[NDArray[np.float64], "m 2"],
) -> ContourPoints:
    """The points that ``samples_px`` on the exact outline of ``mesh`` show.

    Parameters
    ----------
    vertices_cam
        The mesh's vertices (m) in camera coordinates.
    samples_px, outward_px
        Points on the exact outline, and unit vectors out of it along which each is measured.
    """
    ideal = np.column_stack([vertices_cam[:, axis] / vertices_cam[:, 2] for axis in (0, 1)])
    edges = contour_edges(mesh, ideal)
    samples = intrinsics.normalise(samples_px)
    nearest, share = nearest_segments(samples, ideal[edges])
    own = edges[nearest]
    start, along = ideal[own[:, 0]], ideal[own[:, 1]] - ideal[own[:, 0]]
    nearness = (1.0 - share) / vertices_cam[own[:, 0], 2] + share / vertices_cam[own[:, 1], 2]
    points = np.column_stack([start + share[:, None] * along, np.ones(len(share))]) / nearness[:, None]
    lens = _lens(intrinsics, samples)
    by_ideal = np.einsum("mi,mij->mj", _by_move(np.einsum("mij,mj->mi", lens, along), outward_px), lens)
    by_depth = -np.sum(by_ideal * samples, axis=1)
    return ContourPoints(points, np.column_stack([by_ideal, by_depth]) * nearness[:, None])


def _lens(intrinsics: Intrinsics, ideal: Array) -> Array:
    """Derivatives (m, 2, 2) px of pixels by ideal normalised image coordinates (m, 2)."""
    steps = LENS_STEP * np.eye(2)
    return np.stack([(intrinsics.distort(ideal + s) - intrinsics.distort(ideal - s)) / (2 * LENS_STEP) for s in steps], axis=2)


def _by_move(along_px: Array, outward_px: Array) -> Array:
    """How far outlines along ``along_px`` (m, 2) move along ``outward_px`` (m, 2), by a move of theirs in the picture (m, 2)."""
    normal = np.column_stack([along_px[:, 1], -along_px[:, 0]]) / np.linalg.norm(along_px, axis=1)[:, None]
    cosine = np.sum(normal * outward_px, axis=1)
    return np.asarray(normal * (np.sign(cosine) / np.maximum(np.abs(cosine), LEAST_COSINE))[:, None])
