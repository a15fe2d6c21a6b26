"""The tangency error: zero for exact silhouettes, its derivatives, its variance, and pairs without tangent planes."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from shapely import Polygon, box

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.silhouettes import Silhouettes, pack, silhouettes
from estimator.geometry.tangent_hull import TangentHull
from estimator.likelihood.composite_likelihood import weigh

Array = NDArray[np.float64]
HSV = Intrinsics(1024, 1024, 6000.0, 5900.0, 511.5, 500.0)
RIG = Intrinsics(1024, 768, 75000.0, 75000.0, 511.5, 383.5)
CENTRE = np.array([1e-4, -2e-4, 1.5e-4])
SIGMA_PX = 0.1


@pytest.fixture(scope="module")
def points() -> Array:
    rng = np.random.default_rng(3)
    cloud = rng.normal(size=(300, 3))
    return cloud * np.array([3e-3, 2.4e-3, 1.9e-3]) / np.linalg.norm(cloud, axis=1, keepdims=True)


def poses_around(rng: np.random.Generator, count: int, distance_m: float) -> PoseSet:
    R = Rotation.random(count, rng=rng).as_matrix()
    return PoseSet(np.ascontiguousarray(R), np.column_stack([rng.normal(scale=1e-3, size=(count, 2)), np.full(count, distance_m)]))


def seen(points: Array, poses: PoseSet, camera: Intrinsics) -> Silhouettes:
    hulls = []
    for R, t in zip(poses.R, poses.t, strict=True):
        image = camera.project(points @ R.T + t)
        rim = image[ConvexHull(image).vertices]
        hulls.append(TangentHull(rim, np.full(len(rim), SIGMA_PX), 0.2, 0.2, len(rim)))
    return pack(hulls, [camera] * len(hulls))


def moved(poses: PoseSet, step: Array) -> PoseSet:
    """Poses after translations and rotations (n, 6) about CENTRE, along camera axes."""
    turn = Rotation.from_rotvec(step[:, 3:]).as_matrix()
    middle = poses.R @ CENTRE + poses.t + step[:, :3]
    R = turn @ poses.R
    return PoseSet(np.ascontiguousarray(R), np.ascontiguousarray(middle - R @ CENTRE))


def differences(evaluate: Callable[[float], TangencyErrors], width: float) -> tuple[Array, NDArray[np.bool_]]:
    """Central difference of the errors and where both sides keep their tangency points."""
    plus: TangencyErrors = evaluate(width)
    minus: TangencyErrors = evaluate(-width)
    same = (plus.tangency == minus.tangency).all(axis=2) & plus.valid & minus.valid
    return (plus.error - minus.error) / (2.0 * width), same


def test_exact_silhouettes_have_no_error(points: Array) -> None:
    rng = np.random.default_rng(0)
    frames, views = poses_around(rng, 20, 0.6), poses_around(rng, 30, 1.3)
    errors = tangency_errors(seen(points, frames, HSV), frames, seen(points, views, RIG), views, pivot_particle=CENTRE)
    assert errors.valid.mean() > 0.99
    assert np.abs(errors.error[errors.valid]).max() < 1e-8


@pytest.mark.parametrize("column", range(6))
@pytest.mark.parametrize("kind", ["far", "near identity", "grazing"])
def test_pose_columns_are_central_differences(points: Array, column: int, kind: str) -> None:
    rng = np.random.default_rng(column)
    frames = poses_around(rng, 12, 0.6)
    second_camera = RIG if kind == "far" else HSV
    views = poses_around(rng, 15, 1.3 if kind == "far" else 0.6)
    if kind == "near identity":
        views = moved(frames, np.concatenate([rng.normal(scale=3e-4, size=(12, 3)), rng.normal(scale=0.05, size=(12, 3))], axis=1))
    if kind == "grazing":
        turn = rng.normal(scale=0.012, size=(12, 3)) * np.array([1.0, 1.0, 0.1])
        views = moved(frames, np.concatenate([rng.normal(scale=1e-4, size=(12, 3)), turn], axis=1))
    first, second = seen(points, frames, HSV), seen(points, views, second_camera)
    at = moved(frames, np.concatenate([rng.normal(scale=5e-5, size=(12, 3)), rng.normal(scale=0.01, size=(12, 3))], axis=1))

    def evaluate(width: float) -> TangencyErrors:
        step = np.zeros((12, 6))
        step[:, column] = width
        return tangency_errors(first, moved(at, step), second, views, pivot_particle=CENTRE)

    width = 1e-8 if column < 3 else 1e-6
    numeric, same = differences(evaluate, width)
    analytic = evaluate(0.0).jacobian[..., column]
    assert same.sum() > 60
    # Second differences bound what a central difference leaves out.
    bend = np.abs(evaluate(width).error + evaluate(-width).error - 2 * evaluate(0.0).error)[same].max() / width
    scale = np.abs(numeric[same]).max()
    np.testing.assert_allclose(analytic[same], numeric[same], atol=max(1e-6 * scale, bend), rtol=1e-5)


def test_world_axes_turn_the_columns(points: Array) -> None:
    rng = np.random.default_rng(4)
    frames, views = poses_around(rng, 5, 0.6), poses_around(rng, 6, 1.3)
    first, second = seen(points, frames, HSV), seen(points, views, RIG)
    axes = np.ascontiguousarray(Rotation.random(5, rng=rng).as_matrix())
    plain = tangency_errors(first, frames, second, views, pivot_particle=CENTRE)
    turned = tangency_errors(first, frames, second, views, pivot_particle=CENTRE, axes=axes)
    expected = np.einsum("nkmi,nij->nkmj", plain.jacobian[..., :3], axes)
    np.testing.assert_allclose(turned.jacobian[..., :3], expected, atol=1e-6 * np.abs(expected).max())


def test_offset_columns_and_variance_follow_from_moving_the_outlines(points: Array) -> None:
    rng = np.random.default_rng(5)
    frames, views = poses_around(rng, 10, 0.6), poses_around(rng, 12, 1.3)
    first, second = seen(points, frames, HSV), seen(points, views, RIG)
    none = tangency_errors(first, frames, second, views, pivot_particle=CENTRE)
    moved_out = tangency_errors(first, frames, second, views, pivot_particle=CENTRE, offset_px=0.5)
    np.testing.assert_allclose((moved_out.error - none.error)[none.valid], 0.5 * none.jacobian[..., 6][none.valid], atol=1e-9)
    own, other = none.jacobian[..., 6], none.jacobian[..., 7]
    np.testing.assert_allclose(none.variance[none.valid], (SIGMA_PX**2 * (own**2 + other**2))[none.valid], rtol=1e-12)
    # A body grown by one pixel in the first picture: the columns predict the errors of its real silhouettes.
    grown = seen(CENTRE + (points - CENTRE) * 1.002, frames, HSV)
    errors = tangency_errors(grown, frames, second, views, pivot_particle=CENTRE)
    assert np.all(errors.error[..., :2][errors.valid] > 0)
    np.testing.assert_allclose(errors.error[..., 2:], errors.error[..., :2] * own[..., 2:], rtol=2e-2, atol=2e-4)


def test_a_baseline_through_the_silhouette_is_left_out(points: Array) -> None:
    frame = PoseSet(np.eye(3)[None], np.array([[0.0, 0.0, 0.6]]))
    behind = PoseSet(np.eye(3)[None], np.array([[0.0, 0.0, 1.3]]))
    errors = tangency_errors(seen(points, frame, HSV), frame, seen(points, behind, RIG), behind, pivot_particle=CENTRE)
    assert not errors.valid.any()
    assert errors.cost[0] == 0.0


def test_normal_matrices_are_the_whitened_sums(points: Array) -> None:
    rng = np.random.default_rng(6)
    frames, views = poses_around(rng, 4, 0.6), poses_around(rng, 9, 1.3)
    first, second = seen(points, frames, HSV), seen(points, views, RIG)
    at = moved(frames, rng.normal(scale=[1e-4] * 3 + [5e-3] * 3, size=(4, 6)))
    errors = tangency_errors(first, at, second, views, pivot_particle=CENTRE)
    w = 0.5 / errors.variance * errors.valid[..., None]
    np.testing.assert_allclose(errors.normal, np.einsum("nkma,nkm,nkmb->nab", errors.jacobian, w, errors.jacobian), rtol=1e-9)
    np.testing.assert_allclose(errors.gradient, np.einsum("nkma,nkm->na", errors.jacobian, w * errors.error), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(errors.cost, 0.5 * np.sum(w * errors.error**2, axis=(1, 2)), rtol=1e-12)


def sampled(polygon: Polygon, count: int = 150) -> Array:
    """Evenly spaced points (count, 2) of a convex outline, of positive area."""
    ring = polygon.exterior
    points = np.array([ring.interpolate(k / count, normalized=True).coords[0] for k in range(count)])
    return points if Polygon(points).exterior.is_ccw else points[::-1].copy()


def test_what_a_line_hides_leaves_the_tangents_elsewhere_as_they_are(points: Array) -> None:
    """Of a convex silhouette cut along a line whose points are unsure, the tangents that say something are those of the whole."""
    rng = np.random.default_rng(11)
    poses, others = poses_around(rng, 5, 0.3), poses_around(rng, 30, 0.6)
    wholes, cuts, unsure = [], [], []
    for R, t in zip(poses.R, poses.t, strict=True):
        image = HSV.project(points @ R.T + t)
        whole = Polygon(image[ConvexHull(image).vertices])
        edge = image[:, 1].max() - 0.3 * np.ptp(image[:, 1])
        cut = sampled(whole.intersection(box(image[:, 0].min() - 1.0, image[:, 1].min() - 1.0, image[:, 0].max() + 1.0, edge)), 600)
        wholes.append(Outline(sampled(whole, 600)))
        cuts.append(Outline(cut))
        unsure.append(cut[:, 1] > edge - 0.5)
    views = seen(points, others, RIG)
    complete, left = (
        tangency_errors(silhouettes(o, [HSV] * 5, unsure=u), poses, views, others, pivot_particle=CENTRE)
        for o, u in ((wholes, None), (cuts, unsure))
    )
    assert complete.told[complete.valid].all()
    own = left.told[:, :, :2]
    assert 0.55 < own[left.valid].mean() < 0.85
    np.testing.assert_allclose(left.error[:, :, :2][own], complete.error[:, :, :2][own], atol=0.15)
    lost = np.abs(left.error - complete.error)[left.valid[:, :, None] & ~left.told]
    assert np.median(lost) > 1.0
    assert not silhouettes(cuts, [HSV] * 5, unsure=unsure).whole.any()
    assert silhouettes(wholes, [HSV] * 5).whole.all()


def test_a_silhouette_that_is_unsure_all_round_has_no_part(points: Array) -> None:
    """Its pairs have tangent planes, but nothing is told: the sums are those of the others."""
    rng = np.random.default_rng(12)
    poses, others = poses_around(rng, 3, 0.3), poses_around(rng, 12, 0.6)
    images = [HSV.project(points @ R.T + t) for R, t in zip(poses.R, poses.t, strict=True)]
    outlines = [Outline(sampled(Polygon(image[ConvexHull(image).vertices]), 300)) for image in images]
    blind = [np.zeros(300, dtype=bool), np.ones(300, dtype=bool), np.zeros(300, dtype=bool)]
    views = seen(points, others, RIG)
    first = silhouettes(outlines, [HSV] * 3, unsure=blind)
    errors = tangency_errors(first, poses, views, others, pivot_particle=CENTRE)
    S = np.tile(np.eye(8), (3, 1, 1))
    frames = weigh(errors, S, first, floor_px=0.04, huber=4.0)
    assert errors.telling.tolist() == [0, 2]
    assert errors.valid[1].any()
    assert frames.count[1] == 0
    assert min(frames.count[[0, 2]]) > 0
    assert np.isfinite(frames.H).all()
