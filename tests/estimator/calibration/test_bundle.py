"""Bundle adjustment: derivatives, a fit without noise, honest covariance, outliers, rigs."""

import numpy as np
import pytest

from datasets.errors import InputError
from estimator.calibration.bundle import Bundle, Rig, lens_prior, lens_vector, moved, projection_derivatives, with_lens
from estimator.calibration.fitting import cross_validate, difference, fit_rig
from estimator.calibration.sighting import BoardSighting
from tests.calibrations import BOARD, LENS, placements, ring, seen

SIZES = ((LENS.width_px, LENS.height_px),)


def true_rig(cameras, poses) -> Rig:
    stacked = [np.stack([getattr(c, name) for c in cameras]) for name in ("R_cam_world", "t_cam_world")]
    return Rig(tuple(c.intrinsics for c in cameras), *stacked, np.stack([R for R, _ in poses]), np.stack([t for _, t in poses]))


def test_projection_derivatives_are_those_of_central_differences():
    rng = np.random.default_rng(1)
    points = rng.normal((0, 0, 0.15), 0.02, (5, 3))
    by_point, by_lens = projection_derivatives(LENS, points)
    for k in range(3):
        step = np.eye(3)[k] * 1e-7
        numeric = (LENS.project(points + step) - LENS.project(points - step)) / 2e-7
        np.testing.assert_allclose(by_point[:, :, k], numeric, rtol=1e-5, atol=1e-3)
    for k, value in enumerate(lens_vector(LENS)):
        step = np.eye(9)[k] * 1e-5 * max(abs(value), 1.0)
        after, before = (with_lens(LENS, lens_vector(LENS) + sign * step).project(points) for sign in (1, -1))
        np.testing.assert_allclose(by_lens[:, :, k], (after - before) / (2 * step[k]), rtol=1e-5, atol=1e-6)


def test_gradient_is_that_of_central_differences():
    rng = np.random.default_rng(2)
    cameras, poses = ring(2, rng), placements(3, rng)
    rig = true_rig(cameras, poses)
    sightings = seen(cameras, poses, 0.5, rng)
    bundle = Bundle(sightings, {p: p for p in range(3)}, BOARD.corners_m, (0.5,) * len(sightings), lens_prior(rig))
    equations = bundle.linearise(rig)
    scale = 1e-4 / np.sqrt(np.diag(equations.H) + 1e-30)
    for k in range(len(equations.g)):
        step = np.zeros(len(equations.g))
        step[k] = min(scale[k], 1e-2)
        numeric = (bundle.cost(moved(rig, step)) - bundle.cost(moved(rig, -step))) / (2 * step[k])
        assert numeric == pytest.approx(equations.g[k], rel=1e-4, abs=1e-5 * np.sqrt(equations.H[k, k]) + 1e-9)


def test_without_noise_the_rig_is_found_exactly():
    rng = np.random.default_rng(3)
    cameras, poses = ring(3, rng), placements(12, rng)
    fit = fit_rig(seen(cameras, poses, 0.0, rng), BOARD, SIZES * 3)
    assert fit.settled
    assert fit.rms_px < 1e-3
    for camera, lens, R, t in zip(cameras, fit.rig.lenses, fit.rig.R_cam, fit.rig.t_cam, strict=True):
        assert lens.fx_px == pytest.approx(camera.intrinsics.fx_px, abs=0.05)
        np.testing.assert_allclose(R, camera.R_cam_world, atol=1e-5)
        np.testing.assert_allclose(t, camera.t_cam_world, atol=1e-6)


def test_stated_uncertainty_is_that_of_the_errors():
    pulls, honest = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        cameras, poses = ring(2, rng), placements(10, rng)
        fit = fit_rig(seen(cameras, poses, 0.05, rng), BOARD, SIZES * 2)
        off = difference(fit.rig, true_rig(cameras, poses))
        pulls.append(off / np.sqrt(np.diag(fit.covariance)))
        check = cross_validate(fit, BOARD, SIZES * 2)
        honest.append(check is not None and check.honest)
    shown = [0, 1, 2, 3, *range(9, 13), *range(18, 24)]
    assert 0.8 < np.std(np.array(pulls)[:, shown]) < 1.2
    assert np.mean(np.abs(np.array(pulls)[:, shown]) < 1.96) > 0.9
    assert sum(honest) >= 7


def test_shared_errors_are_called_dishonest():
    """A board that is bent the more the later a picture is: noise of single corners does not explain how the halves differ."""
    rng = np.random.default_rng(5)
    cameras = ring(1, rng)
    sightings = []
    for sighting in seen(cameras, placements(16, rng), 0.02, rng):
        pull = 1 + 2e-3 * (-1) ** sighting.picture
        off = (sighting.points_px - sighting.points_px.mean(axis=0)) * [pull, 1.0] + sighting.points_px.mean(axis=0)
        sightings.append(BoardSighting(0, sighting.picture, sighting.corners, off))
    fit = fit_rig(tuple(sightings), BOARD, SIZES)
    check = cross_validate(fit, BOARD, SIZES)
    assert check is not None
    assert not check.honest
    assert check.factor > 1.5


def test_wrong_corners_are_left_out():
    rng = np.random.default_rng(6)
    cameras = ring(1, rng)
    sightings = list(seen(cameras, placements(10, rng), 0.03, rng))
    points = sightings[2].points_px.copy()
    points[3:6] += 3.0
    sightings[2] = BoardSighting(0, sightings[2].picture, sightings[2].corners, points)
    fit = fit_rig(tuple(sightings), BOARD, SIZES)
    assert 3 <= fit.left_out <= 5
    assert fit.rms_px < 0.04


def test_too_few_pictures_and_cameras_that_share_none_are_named():
    rng = np.random.default_rng(7)
    cameras, poses = ring(2, rng), placements(8, rng)
    sightings = seen(cameras, poses, 0.05, rng)
    with pytest.raises(InputError, match="camera 1: expected 3 pictures that show the board or more, got 2"):
        fit_rig(tuple(s for s in sightings if s.camera == 0)[:2], BOARD, SIZES)
    apart = tuple(s for s in sightings if (s.picture < 4) == (s.camera == 0))
    with pytest.raises(InputError, match="camera 2: expected pictures of the board taken at one instant"):
        fit_rig(apart, BOARD, SIZES * 2)
