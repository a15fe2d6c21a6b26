"""Starts of the pose search: support functions rank the true orientation first, and starts are apart."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from estimator.data.views import Poses
from estimator.poses.pose_starts import StartCatalogue, distinct, likely_starts, start_catalogue
from synth.particles.family import procedural
from tests.estimator.exact import degrees_apart, world_poses

Array = NDArray[np.float64]
CENTRE = np.array([4e-4, -3e-4, 2e-4])


@pytest.fixture(scope="module")
def points() -> Array:
    shape = procedural("jagged", 0.5, np.random.default_rng(6))
    solid = trimesh.Trimesh(np.asarray(shape.vertices) * 2.5e-3, shape.faces)
    return np.asarray(solid.vertices) - solid.center_mass + CENTRE


@pytest.fixture(scope="module")
def catalogue(points: Array) -> StartCatalogue:
    return start_catalogue(points, CENTRE)


def outline(points: Array, R: Array, centre_cam: Array) -> Array:
    """Hull (n, 2) of the points in normalised image coordinates; ``centre_cam`` is where CENTRE lies."""
    seen = (points - CENTRE) @ R.T + centre_cam
    flat = seen[:, :2] / seen[:, 2:]
    return np.asarray(flat[ConvexHull(flat).vertices])


def test_catalogue_holds_the_support_functions(points: Array, catalogue: StartCatalogue) -> None:
    assert catalogue.support.shape == (600, 72)
    np.testing.assert_allclose(np.einsum("dij,dkj->dik", catalogue.R, catalogue.R), np.broadcast_to(np.eye(3), (600, 3, 3)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(catalogue.R), 1.0)
    theta = np.radians(5.0 * 17)
    flat = (points - CENTRE) @ catalogue.R[123, :2].T
    assert catalogue.support[123, 17] == pytest.approx(np.max(flat @ [np.cos(theta), np.sin(theta)]))


def test_a_sphere_looks_the_same_from_everywhere() -> None:
    ball = start_catalogue(np.asarray(trimesh.creation.icosphere(subdivisions=4).vertices) * 3e-3, np.zeros(3), directions=50)
    np.testing.assert_allclose(ball.support, 3e-3, rtol=3e-3)
    np.testing.assert_allclose(ball.middle, 0.0, atol=1e-6)


def test_the_best_starts_are_near_the_truth(points: Array, catalogue: StartCatalogue) -> None:
    truth = world_poses(np.random.default_rng(1), 20)
    nearest, rank = [], []
    for R, t in zip(truth.R, truth.t, strict=True):
        starts = likely_starts(outline(points, R, t), catalogue, count=48)
        apart = degrees_apart(starts.R, R)
        nearest.append(apart.min())
        rank.append(int(np.argmax(apart < 12.0)))
        at = int(np.argmin(apart))
        assert np.linalg.norm(starts.centre_cam[at, :2] - t[:2]) < 2e-4
        assert starts.centre_cam[at, 2] == pytest.approx(t[2], rel=0.02)
    # 600 directions and 72 turns: no orientation is further than about 6° from the next of the catalogue.
    assert max(nearest) < 12.0
    assert np.median(rank) == 0.0


def test_starts_are_ranked_and_apart(points: Array, catalogue: StartCatalogue) -> None:
    truth = world_poses(np.random.default_rng(3), 1)
    starts = likely_starts(outline(points, truth.R[0], truth.t[0]), catalogue, count=30, separation_rad=0.2)
    assert len(starts.R) == 30
    assert np.all(np.diff(starts.cost) >= 0.0)
    for i in range(30):
        assert np.delete(degrees_apart(starts.R, starts.R[i]), i).min() > np.degrees(0.2) - 1e-6


def test_an_outline_of_the_catalogue_itself_has_no_mismatch(points: Array, catalogue: StartCatalogue) -> None:
    far = np.array([0.5, -0.2, 1e3])
    best = likely_starts(outline(points, catalogue.R[200], far), catalogue, count=1)
    assert abs(best.cost[0]) < 1e-6
    assert degrees_apart(best.R, catalogue.R[200])[0] < 0.01
    np.testing.assert_allclose(best.centre_cam[0], far, rtol=1e-4)


def test_distinct_keeps_the_cheapest_of_each_cluster() -> None:
    base = Rotation.random(3, rng=np.random.default_rng(0)).as_matrix()
    near = Rotation.from_rotvec([0.01, 0.0, 0.0]).as_matrix() @ base
    costs = np.array([3.0, 1.0, 2.0, 0.5, 4.0, np.inf])
    kept = distinct(Poses(np.concatenate([base, near]), np.arange(18.0).reshape(6, 3), costs), separation_rad=0.05)
    np.testing.assert_array_equal(kept.cost, [0.5, 1.0, 2.0])
    np.testing.assert_array_equal(kept.centre_cam[:, 0], [9.0, 3.0, 6.0])
    nothing = distinct(Poses(base, np.zeros((3, 3)), np.full(3, np.inf)), separation_rad=0.05)
    assert len(nothing.R) == 0
