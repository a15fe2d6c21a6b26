"""Which pose minima stand: containment in the visual hull against closed forms, the chi² limit, and what is left as a status."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from datasets.estimate import Status
from estimator.data.views import Poses, Views
from estimator.geometry.silhouettes import Silhouettes
from estimator.geometry.sphere import fibonacci_sphere
from estimator.poses.pose_competition import compete, own_protrusion_px, protrusion_px, rms_limit_px
from estimator.poses.pose_refinement import pose_errors
from estimator.poses.pose_search import FoundPoses
from tests.estimator.exact import HSV, ellipsoid_outline, ellipsoid_views, exact_silhouettes, rig

SEMI_AXES = np.array([3.0e-3, 2.0e-3, 1.5e-3])
HULL = fibonacci_sphere(4000) * SEMI_AXES
DISTANCE_M = 0.6
PLACE = np.array([0.0, 0.0, DISTANCE_M])
RIGHT = np.eye(3)
TWIN = np.diag([-1.0, -1.0, 1.0])
TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def views() -> Views:
    return ellipsoid_views(SEMI_AXES, rig(3))


@pytest.fixture(scope="module")
def seen() -> Silhouettes:
    return exact_silhouettes([ellipsoid_outline(SEMI_AXES, HSV, (RIGHT, PLACE))], [HSV])


def found(seen: Silhouettes, views: Views, *rotations: NDArray[np.float64]) -> FoundPoses:
    n = len(rotations)
    poses = Poses(np.stack(rotations), np.repeat(PLACE[None], n, axis=0), np.arange(n, dtype=np.float64))
    return FoundPoses(poses, pose_errors(seen.take([0] * n), poses, views).rms_of_each_px)


def test_protrusion_of_a_right_pose_is_nothing_and_of_a_turned_one_the_difference_of_the_axes(seen: Silhouettes, views: Views) -> None:
    protrusion = protrusion_px(seen.take([0, 0, 0]), found(seen, views, RIGHT, TWIN, TURNED).poses, HULL)
    assert np.abs(protrusion[:2]).max() < 0.05
    assert protrusion[2] == pytest.approx(HSV.fx_px * (SEMI_AXES[0] - SEMI_AXES[1]) / DISTANCE_M, rel=0.01)


def test_a_body_is_inside_a_hull_larger_than_itself(seen: Silhouettes, views: Views) -> None:
    at = found(seen, views, RIGHT).poses
    grown = protrusion_px(seen, at, 1.1 * HULL)[0]
    assert grown == pytest.approx(-0.1 * HSV.fx_px * SEMI_AXES[1] / DISTANCE_M, rel=0.02)


def test_calibrated_views_do_not_reach_out_of_their_own_body(views: Views) -> None:
    assert np.abs(own_protrusion_px(views, HULL)).max() < 0.5


def test_a_symmetric_twin_is_ambiguous_and_is_reported(seen: Silhouettes, views: Views) -> None:
    result = compete(found(seen, views, RIGHT, TURNED, TWIN), seen, views, HULL, noise_px=0.1)
    assert result.status is Status.AMBIGUOUS
    assert result.rows.tolist() == [0, 2]


def test_a_pose_that_stands_alone_is_chosen_over_a_cheaper_one_that_protrudes(seen: Silhouettes, views: Views) -> None:
    both = found(seen, views, TURNED, RIGHT)
    both = FoundPoses(both.poses, np.array([0.0, both.rms_px[1]]))
    result = compete(both, seen, views, HULL, noise_px=0.1)
    assert result.status is Status.CONVERGED
    assert result.rows.tolist() == [1]


def test_nothing_that_stands_is_no_convergence(seen: Silhouettes, views: Views) -> None:
    assert compete(found(seen, views, TURNED), seen, views, HULL, noise_px=0.1).status is Status.NO_CONVERGENCE


def test_limit_of_the_error_tightens_with_views_and_is_open_where_nothing_is_left_to_refuse_by() -> None:
    limits = [rms_limit_px(0.0, 1.0, pairs) for pairs in (4, 60, 600)]
    assert rms_limit_px(0.0, 1.0, 3) == float("inf")
    assert rms_limit_px(0.2, 1.0, 5) == pytest.approx(np.sqrt(chi2.ppf(0.95, 4) / 10.0))
    assert limits[-1] == pytest.approx(1.0, abs=0.05)
    assert rms_limit_px(2.0, 1.0, 60) > 2.0


def test_share_of_right_minima_refused_by_the_limit_is_one_in_twenty() -> None:
    rng = np.random.default_rng(3)
    pairs, noise = 8, 0.7
    residuals = noise * rng.standard_normal((20000, 2 * pairs - 6))
    rms = np.sqrt((residuals**2).sum(axis=1) / (2 * pairs))
    assert np.mean(rms > rms_limit_px(0.0, noise, pairs)) == pytest.approx(0.05, abs=0.006)
