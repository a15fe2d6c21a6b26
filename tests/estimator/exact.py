"""Bodies whose outlines and mass properties are known in closed form, or exactly from their mesh, seen by known cameras."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.observation import CalibratedView
from datasets.recipes.recipe import RigRecipe
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline, oriented
from estimator.data.views import Views
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import Silhouettes, pack
from estimator.geometry.tangent_hull import TangentHull
from synth.rig import rig_views

Array = NDArray[np.float64]
HSV = Intrinsics(1024, 1024, 6000.0, 6000.0, 511.5, 511.5)
SIGMA_PX = 0.01


def ellipsoid_outline(semi_axes: Array, camera: Intrinsics, pose: tuple[Array, Array], *, points: int = 400) -> Array:
    """The conic that an ellipsoid about the origin casts, ``C* = P Q* Pᵀ`` [Hartley & Zisserman 2004, eq. 8.6], sampled."""
    R, t = pose
    P = camera.K @ np.column_stack([R, t])
    dual = P @ np.diag([*np.square(semi_axes), -1.0]) @ P.T
    conic = np.linalg.inv(dual)
    middle = dual[:2, 2] / dual[2, 2]
    shape = conic[:2, :2] / -(np.array([*middle, 1.0]) @ conic @ np.array([*middle, 1.0]))
    values, axes = np.linalg.eigh(shape)
    angle = 2.0 * np.pi * np.arange(points) / points
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) / np.sqrt(values)
    return oriented(middle + ring @ axes.T)


def ellipsoid_moments(semi_axes: Array) -> Array:
    """Principal moments over the largest, in the order of the axes."""
    squares = np.square(semi_axes)
    moments = squares.sum() - squares
    return np.asarray(moments / moments.max())


def rig(drops: int, seed: int = 4) -> tuple[CalibratedView, ...]:
    """The default rig's views of a particle with its middle at the origin."""
    return rig_views(RigRecipe(drops=drops), np.zeros(3), np.random.default_rng(seed))


def pose_set(views: Sequence[CalibratedView]) -> PoseSet:
    """Poses of views, packed."""
    return PoseSet(np.stack([v.R_cam_particle for v in views]), np.stack([v.t_cam_particle for v in views]))


def exact_silhouettes(rings: Sequence[Array], cameras: Sequence[Intrinsics]) -> Silhouettes:
    """Convex outlines as they are, unsmoothed, with a nominal noise."""
    return pack([TangentHull(ring, np.full(len(ring), SIGMA_PX), 0.2, 0.2, len(ring)) for ring in rings], cameras)


def ellipsoid_views(semi_axes: Array, views: Sequence[CalibratedView]) -> Views:
    """Exact silhouettes of an ellipsoid in calibrated views."""
    rings = [ellipsoid_outline(semi_axes, v.intrinsics, (v.R_cam_particle, v.t_cam_particle)) for v in views]
    return Views(exact_silhouettes(rings, [v.intrinsics for v in views]), pose_set(views), np.zeros(3))


def ellipsoid_outlines(semi_axes: Array, views: Sequence[CalibratedView]) -> list[Outline]:
    """Exact outlines of an ellipsoid in calibrated views."""
    return [Outline(ellipsoid_outline(semi_axes, v.intrinsics, (v.R_cam_particle, v.t_cam_particle))) for v in views]


def degrees_apart(R: Array, S: Array) -> Array:
    """Angles (deg) between rotations (n, 3, 3) and (3, 3)."""
    return np.degrees(Rotation.from_matrix(R @ S.T).magnitude())


def world_poses(rng: np.random.Generator, count: int) -> PoseSet:
    """Random poses about 0.6 m in front of the high-speed camera."""
    t = np.column_stack([rng.normal(scale=5e-3, size=(count, 2)), rng.normal(0.6, 5e-3, size=count)])
    return PoseSet(np.ascontiguousarray(Rotation.random(count, rng=rng).as_matrix()), t)
