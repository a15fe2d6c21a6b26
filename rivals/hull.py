"""The visual hull of calibrated views, carved on a grid, as a mesh with its mass properties."""

from dataclasses import dataclass

import cv2
import numpy as np
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates
from skimage.measure import marching_cubes

from datasets.observation import CalibratedView, Observation
from datasets.vocabulary.body import Body, signed_axes
from rivals.seen import area_and_centroid, outlines_of, rays

Array = NDArray[np.float64]
CELLS = 72
"""Along each side of the grid: 0.1 mm for a particle of 6 mm, a tenth of which the interpolated surface is off by."""
FINER = 3
"""Points of a view's map of distances for each pixel."""


@dataclass(frozen=True)
class Hull:
    """``mesh`` in the particle frame (m), and the ``body`` that it is at equal density."""

    mesh: trimesh.Trimesh
    body: Body

    @property
    def corners(self) -> Float[NDArray[np.float64], "n 3"]:
        """Corners of its convex hull (m), from its centre of mass along the principal axes."""
        found: Array = (self.mesh.convex_hull.vertices - self.body.com_particle) @ self.body.R_particle_body
        return found


def hull_of(obs: Observation) -> Hull:
    """The hull of the calibrated views.

    Raises
    ------
    ValueError
        Where no view shows the particle, or they have nothing in common.
    """
    seen = [(view, outline) for view, outline in zip(obs.views, outlines_of(obs.view_recording), strict=True) if len(outline)]
    if not seen:
        raise ValueError("expected calibrated views that show the particle, got none")
    middle = _middle(seen)
    reach = 1.15 * max(_reach(view, outline, middle) for view, outline in seen)
    axis = np.linspace(-reach, reach, CELLS)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.full(len(grid), np.inf)
    for view, outline in seen:
        inside = np.minimum(inside, _inside(view, outline, grid + middle))
    if inside.max() <= 0:
        raise ValueError("expected views of one particle, got views whose cones have nothing in common")
    corners, faces, _, _ = marching_cubes(inside.reshape(CELLS, CELLS, CELLS), 0.0, spacing=(axis[1] - axis[0],) * 3)
    mesh = trimesh.Trimesh(corners - reach + middle, faces)
    if mesh.volume < 0:
        mesh.invert()
    return Hull(mesh, _body(mesh))


def _body(mesh: trimesh.Trimesh) -> Body:
    moments, axes = np.linalg.eigh(mesh.moment_inertia)
    return Body(np.array(mesh.center_mass), signed_axes(axes), moments / moments[-1])


def _middle(seen: list[tuple[CalibratedView, Array]]) -> Array:
    """The point (3,) nearest to all rays through the outlines' centroids."""
    matrix, right = np.zeros((3, 3)), np.zeros(3)
    for view, outline in seen:
        ray = rays(view.intrinsics, area_and_centroid(outline)[1][None])[0] @ view.R_cam_particle
        across = np.eye(3) - np.outer(ray, ray)
        matrix += across
        right += across @ (-view.R_cam_particle.T @ view.t_cam_particle)
    return np.array(np.linalg.solve(matrix, right), dtype=np.float64)


def _reach(view: CalibratedView, outline: Array, middle: Array) -> float:
    depth = (view.R_cam_particle @ middle + view.t_cam_particle)[2]
    centre = area_and_centroid(outline)[1]
    return float(np.linalg.norm(outline - centre, axis=1).max() * depth / view.intrinsics.fx_px)


def _inside(view: CalibratedView, outline: Array, points: Array) -> Array:
    """How far (px) inside of a view's outline points (particle frame, m) are seen."""
    low = np.floor(outline.min(axis=0)) - 4
    width, height = (np.ceil(outline.max(axis=0)) + 4 - low).astype(int) * FINER
    mask = np.zeros((height, width), np.uint8)
    corners = np.round((outline - low + 0.5) * FINER - 0.5).astype(np.int32)
    cv2.fillPoly(mask, [corners], 1)
    distance = (distance_transform_edt(mask) - distance_transform_edt(1 - mask) - 0.5) / FINER  # the fill has its boundary, too
    at = (view.intrinsics.project(points @ view.R_cam_particle.T + view.t_cam_particle) - low + 0.5) * FINER - 0.5
    found: Array = map_coordinates(distance, at[:, ::-1].T, order=1, mode="nearest")
    return found
