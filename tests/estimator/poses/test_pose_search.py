"""The pose search on exact outlines: a known pose is found, and minima that compete are reported with their RMS."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.data.views import Poses, Views
from estimator.geometry.silhouettes import Silhouettes
from estimator.poses.pose_refinement import pose_errors, refine
from estimator.poses.pose_search import SearchEffort, search_pose
from estimator.poses.pose_starts import StartCatalogue, likely_starts, start_catalogue
from synth.particles.family import procedural
from synth.silhouette.exact_outline import exact_outline, outline_mesh
from tests.estimator.exact import HSV, degrees_apart, exact_silhouettes, pose_set, rig, world_poses

Array = NDArray[np.float64]
EFFORT = SearchEffort()
Scene = tuple[Views, StartCatalogue, Callable[[Array, Array], Silhouettes]]
HALF_TURNS = [np.diag(d) for d in ([1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0])]


def stone_vertices() -> tuple[Array, Array]:
    shape = procedural("cut_stone", 0.7, np.random.default_rng(2))
    hull = trimesh.Trimesh(np.asarray(shape.vertices) * 2.5e-3, shape.faces)
    return np.asarray(hull.vertices) - hull.center_mass, np.asarray(hull.faces)


def scene(vertices: Array, faces: Array) -> Scene:
    """Views of a body, its starts, and what the high-speed camera sees of it."""
    mesh, views = outline_mesh(vertices, faces), rig(6)
    rings = [exact_outline(mesh, v.intrinsics, v.R_cam_particle, v.t_cam_particle) for v in views]
    calibrated = Views(exact_silhouettes(rings, [v.intrinsics for v in views]), pose_set(views), np.zeros(3))
    return calibrated, start_catalogue(vertices, np.zeros(3)), lambda R, t: exact_silhouettes([exact_outline(mesh, HSV, R, t)], [HSV])


@pytest.fixture(scope="module")
def scenes() -> dict[str, Scene]:
    """An irregular stone, and a box, which is the same body when turned by 180° about an axis."""
    box = trimesh.creation.box(extents=[5.2e-3, 4.1e-3, 3.0e-3])
    return {"stone": scene(*stone_vertices()), "box": scene(np.asarray(box.vertices), np.asarray(box.faces))}


def test_known_poses_are_found(scenes: dict[str, Scene]) -> None:
    views, catalogue, seen = scenes["stone"]
    truth = world_poses(np.random.default_rng(1), 6)
    for R, t in zip(truth.R, truth.t, strict=True):
        found = search_pose(seen(R, t), views, catalogue, EFFORT)
        assert degrees_apart(found.poses.R[:1], R)[0] < 0.05
        assert np.all(np.abs(found.poses.centre_cam[0] - t) < [2e-6, 2e-6, 2e-4])
        assert found.rms_px[0] < 0.02
        assert np.all(np.diff(found.rms_px) >= 0.0)
        assert np.all(found.rms_px[1:] > 5.0 * found.rms_px[0] + 0.1)


def test_reported_rms_is_that_of_the_pose(scenes: dict[str, Scene]) -> None:
    views, catalogue, seen = scenes["stone"]
    truth = world_poses(np.random.default_rng(9), 1)
    silhouette = seen(truth.R[0], truth.t[0])
    found = search_pose(silhouette, views, catalogue, EFFORT)
    again = pose_errors(silhouette.take([0] * len(found.rms_px)), found.poses, views).rms_of_each_px
    np.testing.assert_array_equal(again, found.rms_px)
    errors = pose_errors(silhouette, found.poses.take(np.array([1])), views)
    mine = errors.error[0, errors.valid[0], :2]
    assert found.rms_px[1] == pytest.approx(np.sqrt(np.mean(mine**2)), rel=1e-12)
    assert found.rms_px[1] > 0.1
    assert pose_errors(silhouette, Poses(truth.R, truth.t, np.zeros(1)), views).rms_of_each_px[0] < 1e-6


def test_symmetric_and_antipodal_poses_are_reported_with_their_rms(scenes: dict[str, Scene]) -> None:
    """Four poses of a box are the same; four from behind are so but for perspective, and cost a tenth of a pixel."""
    views, catalogue, seen = scenes["box"]
    truth = world_poses(np.random.default_rng(2), 3)
    mirror = np.diag([1.0, 1.0, -1.0])
    for R, t in zip(truth.R, truth.t, strict=True):
        found = search_pose(seen(R, t), views, catalogue, EFFORT)
        assert len(found.rms_px) == 8
        to_same = np.array([degrees_apart(found.poses.R, R @ turn) for turn in HALF_TURNS])
        to_behind = np.array([degrees_apart(found.poses.R, mirror @ R @ mirror @ turn) for turn in HALF_TURNS])
        assert np.all(to_same[:, :4].min(axis=1) < 0.01)
        assert np.all(to_behind[:, 4:].min(axis=1) < 3.0)
        assert found.rms_px[:4].max() < 1e-3
        assert np.all((found.rms_px[4:] > 0.03) & (found.rms_px[4:] < 0.3))


def test_a_refined_pose_never_costs_more_than_its_start(scenes: dict[str, Scene]) -> None:
    views, _, seen = scenes["stone"]
    truth = world_poses(np.random.default_rng(4), 1)
    silhouette = seen(truth.R[0], truth.t[0])
    turns = Rotation.random(20, rng=np.random.default_rng(5)).as_matrix()
    starts = Poses(turns, np.repeat(truth.t, 20, axis=0), np.zeros(20))
    many = silhouette.take([0] * 20)
    costs = [refine(many, starts, views, iterations=n).cost for n in (0, 1, 5, 25)]
    assert np.all(np.diff(costs, axis=0) <= 1e-12)
    assert np.median(costs[3]) < 0.4 * np.median(costs[0])


def test_an_outline_without_vertices_has_no_cost(scenes: dict[str, Scene]) -> None:
    views, catalogue, seen = scenes["stone"]
    empty = seen(np.eye(3), np.array([0.0, 0.0, 0.6])).take([0])
    nothing = Silhouettes(
        empty.xy, empty.points_px, empty.sigma_px, np.array([0, 0]), empty.correlation_rad, empty.noise_px, empty.samples, empty.focal_px
    )
    starts = likely_starts(empty.xy, catalogue, count=5)
    assert not np.isfinite(refine(nothing.take([0] * len(starts.R)), starts, views, iterations=3).cost).any()
