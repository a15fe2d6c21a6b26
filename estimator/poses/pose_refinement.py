"""Levenberg-Marquardt on the pose of one silhouette against calibrated views, for many starts at once.

A rotation turns the particle about its own centre of mass, not about the camera; that alone doubles the share of starts that
converge. All starts advance together, each with its own damping [Marquardt 1963]; the kernel's per-silhouette 6x6 normal matrices are
all that is needed. A pair without tangent planes has no cost, so poses are compared by their mean cost per valid pair.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.data.views import Poses, Views
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.silhouettes import Silhouettes
from estimator.motion.rotation import rotation_from_vector

Array = NDArray[np.float64]
MINIMUM_VALID_SHARE = 0.5
"""Of the pairs with views that need a common tangent plane, or the pose is no candidate. By judgement."""
FIRST_DAMPING, LARGEST_DAMPING = 1e-2, 1e8
"""Of Levenberg-Marquardt, over the diagonal; a start whose damping grows beyond the second has nowhere to go."""


def pose_set(R: Array, centre_cam: Array, centre_particle: Array) -> PoseSet:
    """Poses from rotations and the place of the centre of mass.

    ``R`` (n, 3, 3) from particle to camera axes, ``centre_cam`` (n, 3) m, ``centre_particle`` (3,) m.
    """
    return PoseSet(np.ascontiguousarray(R), np.ascontiguousarray(centre_cam - R @ centre_particle))


def pose_errors(first: Silhouettes, poses: Poses, views: Views, *, huber: float = np.inf) -> TangencyErrors:
    """ETE of candidate ``i`` as the pose of silhouette ``first[i]``, in the axes of its camera."""
    chosen = pose_set(poses.R, poses.centre_cam, views.centre)
    return tangency_errors(first, chosen, views.silhouettes, views.poses, pivot_particle=views.centre, huber=huber)


@dataclass(frozen=True)
class Equations:
    """Of n candidates: ``cost`` (n,) per valid pair, and the normal matrix (n, 6, 6) and gradient (n, 6) of translation and rotation."""

    cost: Array
    normal: Array
    gradient: Array


def refine(first: Silhouettes, poses: Poses, views: Views, *, iterations: int, tolerance: float = 1e-5, huber: float = np.inf) -> Poses:
    """The candidates after at most ``iterations`` damped steps; each stops when its cost falls by less than ``tolerance`` (relative)."""

    def equations(trial: Poses, rows: NDArray[np.int64]) -> Equations:
        errors = pose_errors(first.take(rows.tolist()), trial, views, huber=huber)
        return Equations(mean_cost(errors), errors.normal[:, :6, :6], errors.gradient[:, :6])

    return descend(equations, poses, iterations=iterations, tolerance=tolerance)


def descend(equations: Callable[[Poses, NDArray[np.int64]], Equations], poses: Poses, *, iterations: int, tolerance: float = 1e-5) -> Poses:
    """Damped steps from every candidate of its own; ``equations`` says cost and derivatives of the candidates that have the numbers given.

    A step moves ``centre_cam`` by its first three numbers and turns ``R``, from the left, by the last three.
    """
    n = len(poses.R)
    damping = np.full(n, FIRST_DAMPING)
    active = np.ones(n, dtype=np.bool_)
    R, centre = poses.R.copy(), poses.centre_cam.copy()
    now = equations(poses, np.arange(n))
    cost, normal, gradient = now.cost.copy(), now.normal.copy(), now.gradient.copy()
    for _ in range(iterations):
        rows = np.flatnonzero(active & np.isfinite(cost))
        if len(rows) == 0:
            break
        step = damped_step(normal[rows], gradient[rows], damping[rows])
        trial = Poses(rotation_from_vector(step[:, 3:]) @ R[rows], centre[rows] + step[:, :3], cost[rows])
        new = equations(trial, rows)
        better = new.cost < cost[rows]
        done = better & (cost[rows] - new.cost <= tolerance * cost[rows])
        took = rows[better]
        R[took], centre[took], cost[took] = trial.R[better], trial.centre_cam[better], new.cost[better]
        normal[took], gradient[took] = new.normal[better], new.gradient[better]
        damping[took] = np.maximum(damping[took] / 10.0, 1e-9)
        damping[rows[~better]] *= 10.0
        active[rows[done]] = False
        active[damping > LARGEST_DAMPING] = False
    return Poses(R, centre, cost)


def damped_step(normal: Array, gradient: Array, damping: Array) -> Array:
    """Marquardt's step (n, p): ``-(H + lambda diag H)⁻¹ g``; ``normal`` (n, p, p), ``gradient`` (n, p), ``damping`` (n,)."""
    diagonal = np.einsum("nii->ni", normal)
    scale = np.maximum(diagonal, 1e-12 * diagonal.max(axis=1, keepdims=True) + 1e-300)
    damped = normal + (damping[:, None] * scale)[:, :, None] * np.eye(normal.shape[1])
    return np.asarray(-np.linalg.solve(damped, gradient[:, :, None])[:, :, 0])


def mean_cost(errors: TangencyErrors) -> Array:
    """Cost per valid pair (n,); infinite where too few pairs are valid."""
    count = errors.valid.sum(axis=1)
    enough = count >= max(2, MINIMUM_VALID_SHARE * errors.valid.shape[1])
    return np.where(enough, errors.cost / np.maximum(count, 1), np.inf)
