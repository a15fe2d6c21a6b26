"""Derivative of the tangency error by the focal length: central differences, and what perspective says about it."""

import numpy as np
import pytest

from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.focal_derivative import focal_derivative, with_focal
from estimator.geometry.silhouettes import Silhouettes
from tests.estimator.exact import HSV, ellipsoid_outline, ellipsoid_views, exact_silhouettes, rig, world_poses

SEMI_AXES = np.array([3.0e-3, 2.0e-3, 1.5e-3])
VIEWS = ellipsoid_views(SEMI_AXES, rig(2))
STEP = 1e-6


def errors_at(seen: Silhouettes, poses: PoseSet, log_factor: float) -> TangencyErrors:
    return tangency_errors(with_focal(seen, log_factor), poses, VIEWS.silhouettes, VIEWS.poses, pivot_particle=np.zeros(3))


@pytest.mark.parametrize("wrong_by", [0.0, 0.05])
def test_agrees_with_central_differences(wrong_by: float) -> None:
    rng = np.random.default_rng(1)
    poses = world_poses(rng, 12)
    seen = exact_silhouettes([ellipsoid_outline(SEMI_AXES, HSV, (R, t)) for R, t in zip(poses.R, poses.t, strict=True)], [HSV] * 12)
    t = poses.t + rng.normal(scale=2e-4, size=poses.t.shape)
    moved = PoseSet(poses.R, t)
    seen = with_focal(seen, wrong_by)
    errors, plus, minus = (errors_at(seen, moved, d) for d in (0.0, STEP, -STEP))
    analytic = focal_derivative(seen, moved, VIEWS.silhouettes, VIEWS.poses, errors)
    same = errors.valid & np.all(plus.tangency == minus.tangency, axis=2)
    assert np.count_nonzero(same) > 0.9 * errors.valid.size
    difference = (plus.error - minus.error) / (2.0 * STEP)
    assert np.abs(analytic[same]).max() > 10.0
    np.testing.assert_allclose(analytic[same], difference[same], rtol=1e-5, atol=1e-4)


def test_a_pair_without_tangents_has_no_derivative() -> None:
    poses = world_poses(np.random.default_rng(2), 1)
    seen = exact_silhouettes([ellipsoid_outline(SEMI_AXES, HSV, (poses.R[0], poses.t[0]))], [HSV])
    weight = np.zeros((1, len(VIEWS.silhouettes)))
    weight[0, 0] = 1.0
    errors = tangency_errors(seen, poses, VIEWS.silhouettes, VIEWS.poses, pivot_particle=np.zeros(3), weight=weight)
    analytic = focal_derivative(seen, poses, VIEWS.silhouettes, VIEWS.poses, errors)
    assert np.all(analytic[0, 1:] == 0.0)
    assert np.any(analytic[0, 0] != 0.0)


def test_distance_takes_up_all_but_the_perspective_of_a_small_particle() -> None:
    poses = world_poses(np.random.default_rng(3), 1)
    poses = PoseSet(poses.R, np.array([[0.0, 0.0, 0.6]]))
    seen = exact_silhouettes([ellipsoid_outline(SEMI_AXES, HSV, (poses.R[0], poses.t[0]))], [HSV])
    errors = errors_at(seen, poses, 0.0)
    by_focal = focal_derivative(seen, poses, VIEWS.silhouettes, VIEWS.poses, errors)[errors.valid]
    by_depth = errors.jacobian[errors.valid][:, :, 2]
    left = by_focal + poses.t[0, 2] * by_depth
    assert np.abs(left).max() < 0.03 * np.abs(by_focal).max()
