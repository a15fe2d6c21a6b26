"""Poses and focal length together: recovered from exact outlines, silent where perspective is, held by a prior."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.vocabulary.camera import Intrinsics
from estimator.data.views import Poses, Views
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.focal_derivative import with_focal
from estimator.geometry.silhouettes import Silhouettes
from scripts.real.focal_poses import FocalPrior, poses_with_focal
from tests.estimator.exact import degrees_apart, exact_silhouettes, pose_set, rig, world_poses

Array = NDArray[np.float64]
CORNERS = 3e-3 * np.random.default_rng(11).normal(size=(40, 3)) * [1.0, 0.7, 0.5]
"""Corners (m) of a polytope. An ellipsoid would not do: its outline has five numbers, fewer than the parameters."""
FREE = FocalPrior(np.inf)


def outline(camera: Intrinsics, pose: tuple[Array, Array]) -> Array:
    """The polytope's outline (px): the hull of its corners' images."""
    corners = camera.project(CORNERS @ pose[0].T + pose[1])
    return corners[ConvexHull(corners).vertices]


@pytest.fixture(scope="module")
def views() -> Views:
    given = rig(4)
    rings = [outline(v.intrinsics, (v.R_cam_particle, v.t_cam_particle)) for v in given]
    return Views(exact_silhouettes(rings, [v.intrinsics for v in given]), pose_set(given), np.zeros(3))


def near(count: int, distance_m: float, focal_px: float, wrong_by: float) -> tuple[Silhouettes, PoseSet, Poses]:
    """Exact silhouettes at a distance, taken for ones of a focal length ``exp(wrong_by)`` times too long; true poses, and starts."""
    rng = np.random.default_rng(7)
    camera = Intrinsics(1024, 1024, focal_px, focal_px, 511.5, 511.5)
    poses = world_poses(rng, count)
    t = poses.t * [1.0, 1.0, distance_m / 0.6]
    seen = exact_silhouettes([outline(camera, p) for p in zip(poses.R, t, strict=True)], [camera] * count)
    start = t * [1.0, 1.0, np.exp(wrong_by)]
    return with_focal(seen, wrong_by), PoseSet(poses.R, t), Poses(poses.R, start, np.full(count, np.inf))


@pytest.mark.parametrize("wrong_by", [0.05, -0.2])
@pytest.mark.parametrize("count", [1, 6])
def test_focal_length_and_poses_are_recovered_near_by(views: Views, count: int, wrong_by: float) -> None:
    seen, truth, start = near(count, 0.05, 900.0, wrong_by)
    found = poses_with_focal(seen, start, views, FREE)
    assert found.settled
    assert found.log_factor == pytest.approx(-wrong_by, abs=2e-3)
    assert degrees_apart(found.poses.R[0], truth.R[0]) < 0.2
    assert found.poses.centre_cam[0, 2] == pytest.approx(truth.t[0, 2], rel=3e-3)
    assert found.rms_px.max() < 0.02


def test_error_bar_falls_with_sightings_and_grows_with_distance(views: Views) -> None:
    sigma = {}
    for count, distance in ((1, 0.05), (6, 0.05), (6, 0.6)):
        seen, _, start = near(count, distance, 18000.0 * distance, 0.0)
        sigma[count, distance] = poses_with_focal(seen, start, views, FREE).sigma
    assert sigma[6, 0.05] < 0.7 * sigma[1, 0.05]
    assert sigma[6, 0.6] > 5.0 * sigma[6, 0.05]


def test_prior_holds_what_the_pictures_do_not_say(views: Views) -> None:
    seen, _, start = near(1, 1.3, 80000.0, 0.05)
    found = poses_with_focal(seen, start, views, FocalPrior(0.01))
    assert abs(found.log_factor) < 0.02
    assert found.sigma == pytest.approx(0.01, rel=0.3)
