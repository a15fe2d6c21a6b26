"""Matrices of a mirrored world, and how to turn it inside out.

A reconstruction from pictures alone is known up to a reflection: ``P diag(-1, -1, -1, 1)`` shows the mirrored world in the same pixels. A
camera of positive depth has ``R`` alike and ``-t`` in the place of ``t``, so that all that was in front of every camera lies behind it
[Hartley & Zisserman 2004, 21.2]. Lenses' distortion is left aside.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.optimize import linprog

from datasets.errors import InputError
from datasets.vocabulary.camera import HsvCamera

Array = NDArray[np.float64]
TURNED = (
    "The axes of these cameras meet behind every one of them: the matrices are of a mirror image of the world, as reconstructions from "
    "pictures alone may be. The world is turned inside out (X to -X), so that the particle lies in front and its shape is the real one."
)


def in_front(cameras: Sequence[HsvCamera], where: str) -> tuple[tuple[HsvCamera, ...], tuple[str, ...]]:
    """The cameras with what they see in front of them, and a sentence where the world was turned inside out for it.

    They are left as they are where some place is in front of all and in all pictures (cameras side by side may diverge a little), and where
    the point nearest to all axes is in front of all.

    Raises
    ------
    InputError
        Naming ``where``: that point is behind some cameras, and turning the world inside out gives them no place in common.
    """
    if len(cameras) < 2 or see_one_place(cameras):
        return tuple(cameras), ()
    depths = depths_of(nearest_to_axes(cameras), cameras)
    if np.all(depths > 0):
        return tuple(cameras), ()
    turned = inside_out(cameras)
    if np.all(depths < 0) and see_one_place(turned):
        return turned, (TURNED,)
    raise InputError(
        f"{where}: expected cameras that see one place, got no place that is in front of all and in all their pictures; the point nearest "
        f"to their axes is {_fewer(cameras, depths)}. Are all matrices of one world, and is --size that of their pictures?"
    )


def _fewer(cameras: Sequence[HsvCamera], depths: Array) -> str:
    """In words, which cameras have a point behind them, or in front where those are fewer."""
    behind = [camera.name for camera, depth in zip(cameras, depths, strict=True) if depth <= 0]
    front = [camera.name for camera, depth in zip(cameras, depths, strict=True) if depth > 0]
    if not front:
        return "behind every one"
    if len(behind) <= len(front):
        return f"behind {', '.join(behind)} and in front of the others"
    return f"in front of {', '.join(front)} and behind the others"


def inside_out(cameras: Sequence[HsvCamera]) -> tuple[HsvCamera, ...]:
    """The same cameras in the mirrored world, X to -X: their pixels are those that they were."""
    return tuple(replace(camera, t_cam_world=-camera.t_cam_world) for camera in cameras)


def nearest_to_axes(cameras: Sequence[HsvCamera]) -> Float[NDArray[np.float64], "3"]:
    """The point (3,) m of the world whose squared distances from the optical axes are least in sum; of parallel axes the least such."""
    across = [np.eye(3) - np.outer(camera.R_cam_world[2], camera.R_cam_world[2]) for camera in cameras]
    centres = [-camera.R_cam_world.T @ camera.t_cam_world for camera in cameras]
    return np.asarray(np.linalg.lstsq(np.concatenate(across), np.concatenate([A @ c for A, c in zip(across, centres, strict=True)]))[0])


def depths_of(point_world: Float[NDArray[np.float64], "3"], cameras: Sequence[HsvCamera]) -> Float[NDArray[np.float64], " camera"]:
    """The depth (m) of a point in every camera; below zero: behind it."""
    return np.array([camera.R_cam_world[2] @ point_world + camera.t_cam_world[2] for camera in cameras])


def see_one_place(cameras: Sequence[HsvCamera]) -> bool:
    """Whether some place is in front of every camera and in every picture: a linear programme for the largest ball in all of them."""
    sides = [_field_of_view(camera) for camera in cameras]
    normals = np.concatenate([A @ camera.R_cam_world for A, camera in zip(sides, cameras, strict=True)])
    scale = max(float(np.linalg.norm(camera.t_cam_world)) for camera in cameras) or 1.0
    offsets = np.concatenate([A @ camera.t_cam_world / scale for A, camera in zip(sides, cameras, strict=True)])
    radius = np.ones((len(normals), 1))
    bounds = [(None, None)] * 3 + [(None, 1.0)]  # fields of view are without end: a ball of the rig's own size is enough
    found = linprog([0.0, 0.0, 0.0, -1.0], A_ub=np.hstack([-normals, radius]), b_ub=offsets, bounds=bounds)
    return bool(found.success and found.x is not None and found.x[3] > 0.0)


def _field_of_view(camera: HsvCamera) -> Array:
    """Unit normals (5, 3), inwards, of the sides and the front of what a camera sees, in its own coordinates."""
    lens = camera.intrinsics
    left, top = lens.cx_px + 0.5, lens.cy_px + 0.5
    right, bottom = lens.width_px - left, lens.height_px - top
    planes = [[lens.fx_px, 0.0, left], [-lens.fx_px, 0.0, right], [0.0, lens.fy_px, top], [0.0, -lens.fy_px, bottom], [0.0, 0.0, 1.0]]
    return np.array(planes) / np.linalg.norm(planes, axis=1)[:, None]
