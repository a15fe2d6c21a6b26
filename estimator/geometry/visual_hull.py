"""The visual hull: the largest body that casts the calibrated outlines [Laurentini 1994], by volumetric carving.

Every voxel gets the smallest of its signed distances to the outlines (px turned to m by depth over focal length); the zero
level is polygonised by marching cubes [Lewiner 2003, scikit-image]. The hull contains the body: concavities that no view
looks into stay filled, so volume is over-estimated and centre of mass and inertia inherit a bias, which falls with views.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numba
import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh

Array = NDArray[np.float64]
MARGIN_PX = 8
"""Of a mask around an outline."""
SUBPIXEL_BITS = 6
"""Binary digits of a pixel to which corners of a mask are drawn."""


@dataclass(frozen=True)
class _DistanceImage:
    """Signed distance (px, positive inside) on a crop whose first pixel is ``corner_px``."""

    values: NDArray[np.float32]
    corner_px: Array


def visual_hull(outlines: Sequence[Outline], views: Sequence[CalibratedView], *, resolution: int = 64) -> SurfaceMesh:
    """Carve a grid of ``resolution``³ voxels with every view that has an outline.

    Raises
    ------
    InputError
        Where fewer than three views have an outline, or the views leave nothing.
    """
    used = [(o, v) for o, v in zip(outlines, views, strict=True) if not o.empty]
    if len(used) < 3:
        raise InputError(f"calibrated views: expected at least 3 with an outline for a visual hull, got {len(used)}")
    centre, radius = bounding_ball([o for o, _ in used], [v for _, v in used])
    grid = [c + np.linspace(-radius, radius, resolution) for c in centre]
    points = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 3)
    step = 2.0 * radius / (resolution - 1)
    depth = np.full(len(points), np.inf)
    alive = np.arange(len(points))
    for outline, view in used:
        distance = inside_by(outline, view)(points[alive])
        depth[alive] = np.minimum(depth[alive], distance)
        alive = alive[depth[alive] > -2.0 * step]
    volume = np.maximum(depth, -2.0 * step).reshape((resolution,) * 3)
    if volume.max() <= 0.0:
        raise InputError("calibrated views: expected outlines that agree on a body, got an empty visual hull; a view may not belong")
    vertices, faces, _, _ = marching_cubes(volume, 0.0, spacing=(step, step, step), gradient_direction="ascent")
    return SurfaceMesh(vertices=vertices.astype(np.float64) + centre - radius, faces=faces.astype(np.int64))


def bounding_ball(outlines: Sequence[Outline], views: Sequence[CalibratedView]) -> tuple[Array, float]:
    """Centre (3,) and radius (m) of a ball that holds the body: the rays through the outlines' middles meet in its centre."""
    normal, right = np.zeros((3, 3)), np.zeros(3)
    middles = [
        v.intrinsics.normalise(0.5 * (o.points_px.min(0) + o.points_px.max(0))[None])[0] for o, v in zip(outlines, views, strict=True)
    ]
    for (x, y), view in zip(middles, views, strict=True):
        ray = view.R_cam_particle.T @ np.array([x, y, 1.0])
        ray /= np.linalg.norm(ray)
        across = np.eye(3) - np.outer(ray, ray)
        normal += across
        right += across @ (-view.R_cam_particle.T @ view.t_cam_particle)
    centre = np.linalg.solve(normal, right)
    radius = 0.0
    for (x, y), outline, view in zip(middles, outlines, views, strict=True):
        z = float((view.R_cam_particle @ centre + view.t_cam_particle)[2])
        spread = view.intrinsics.normalise(outline.points_px) - np.array([x, y])
        radius = max(radius, z * float(np.linalg.norm(spread, axis=1).max()))
    return np.asarray(centre, dtype=np.float64), 1.03 * radius


def inside_by(outline: Outline, view: CalibratedView) -> Callable[[Array], Array]:
    """How far (m, n) points (n, 3), particle frame, project inside an outline; negative outside."""
    image = _distance_image(outline)

    def distance(points: Array) -> Array:
        cam = points @ view.R_cam_particle.T + view.t_cam_particle
        px = view.intrinsics.project(cam) - image.corner_px
        return np.asarray(_inside_px(image.values, px) * cam[:, 2] / view.intrinsics.fx_px)

    return distance


@numba.njit(cache=True)
def _inside_px(values, px):  # type: ignore[no-untyped-def]
    """An image's ``values`` (h, w) at ``px`` (n, 2), linear between pixels; beside it those of its edge less how far away that is."""
    found, wide, high = np.empty(len(px)), values.shape[1] - 1, values.shape[0] - 1
    for k in range(len(px)):
        x, y = px[k, 0] if px[k, 0] > 0.0 else 0.0, px[k, 1] if px[k, 1] > 0.0 else 0.0  # what is no number lies at the edge, too
        x, y = min(x, wide), min(y, high)
        i, j = min(int(x), wide - 1), min(int(y), high - 1)
        across, down = x - i, y - j
        upper = values[j, i] * (1.0 - across) + values[j, i + 1] * across
        lower = values[j + 1, i] * (1.0 - across) + values[j + 1, i + 1] * across
        found[k] = upper * (1.0 - down) + lower * down - abs(px[k, 0] - x) - abs(px[k, 1] - y)
    return found


def _distance_image(outline: Outline) -> _DistanceImage:
    low = np.floor(outline.points_px.min(axis=0)) - MARGIN_PX
    size = (np.ceil(outline.points_px.max(axis=0)) + MARGIN_PX - low).astype(int) + 1
    mask = np.zeros((size[1], size[0]), dtype=np.uint8)
    polygon = np.round((outline.points_px - low) * (1 << SUBPIXEL_BITS)).astype(np.int32)
    # OpenCV paints the polygon's border too: shift-precision vertices keep the bias below a tenth of a pixel after centring.
    cv2.fillPoly(mask, [polygon], 255, lineType=cv2.LINE_AA, shift=SUBPIXEL_BITS)
    inside = cv2.distanceTransform((mask > 127).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    outside = cv2.distanceTransform((mask <= 127).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    values = np.where(mask > 127, inside - 0.5, 0.5 - outside).astype(np.float32)
    return _DistanceImage(values=values, corner_px=low)
