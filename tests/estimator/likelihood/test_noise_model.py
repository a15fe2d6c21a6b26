"""Noise measured from residuals equals the noise put in: made-up errors first, then outlines with correlated boundary noise."""

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.vocabulary.outline import Outline
from estimator.geometry.epipolar_tangency import TangencyErrors, empty_errors, tangency_errors
from estimator.geometry.silhouettes import silhouettes
from estimator.likelihood.noise_model import measured_noise, tangent_correlation, with_noise
from tests.estimator.exact import HSV, ellipsoid_outline, ellipsoid_views, rig, world_poses

Array = NDArray[np.float64]


def made_up(rng: np.random.Generator, *, scale: float, length_rad: float, sightings: int = 150) -> TangencyErrors:
    """Errors of 60 views whose own tangents have the noise model's covariance, times ``scale``."""
    errors = empty_errors(sightings, 60)
    errors.valid[:] = True
    errors.variance[:] = rng.uniform(0.01, 0.04, size=errors.variance.shape)
    for i in range(sightings):
        angle = rng.uniform(-np.pi, np.pi, size=60)
        both = np.column_stack([angle, angle + np.pi])
        u = np.stack([np.cos(both), np.sin(both)], axis=-1)
        errors.direction[i, :, :2] = u
        K = tangent_correlation(u.reshape(-1, 2), length_rad)
        z = np.linalg.cholesky(K + 1e-9 * np.eye(120)) @ rng.normal(size=120)
        errors.error[i, :, :2] = np.sqrt(scale * errors.variance[i, :, :2]) * z.reshape(60, 2)
    return errors


@pytest.mark.parametrize("length_deg", [6.0, 12.0, 20.0])
@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_size_and_correlation_of_made_up_errors(length_deg: float, scale: float) -> None:
    noise = measured_noise(made_up(np.random.default_rng(1), scale=scale, length_rad=np.radians(length_deg)))
    assert noise.scale == pytest.approx(scale, rel=0.05)
    assert noise.mean_square == pytest.approx(scale, rel=0.05)
    assert noise.correlation_rad == pytest.approx(np.radians(length_deg), rel=0.06)


def test_far_errors_are_clipped_in_the_scale_alone() -> None:
    errors = made_up(np.random.default_rng(2), scale=1.0, length_rad=0.2)
    errors.error[:, :3, 0] += 20.0 * np.sqrt(errors.variance[:, :3, 0])
    noise = measured_noise(errors)
    # A share of 1/40 of the errors lies 20 standard deviations off: 400/40 in the mean square, 16/40 where clipped at 4.
    assert noise.mean_square == pytest.approx(11.0, rel=0.05)
    assert noise.scale == pytest.approx(1.4, rel=0.05)


def test_no_valid_pair_is_no_noise_and_no_failure() -> None:
    noise = measured_noise(empty_errors(3, 5))
    assert noise.scale == 0.0
    assert np.isfinite(noise.correlation_rad)


def test_correlation_of_tangents_is_a_correlation() -> None:
    angle = np.sort(np.random.default_rng(3).uniform(-np.pi, np.pi, size=80))
    K = tangent_correlation(np.column_stack([np.cos(angle), np.sin(angle)]), 0.3)
    np.testing.assert_array_equal(np.diag(K), 1.0)
    np.testing.assert_allclose(K, K.T)
    assert np.linalg.eigvalsh(K).min() > 0.0
    ends = np.array([[np.cos(a), np.sin(a)] for a in (np.pi - 0.1, -np.pi + 0.1)])
    assert tangent_correlation(ends, 0.3)[0, 1] == pytest.approx(np.exp(-0.2 / 0.3))


SEMI_AXES = np.array([3.2e-3, 2.7e-3, 2.3e-3])
OUTWARD = np.array([[np.cos(a), np.sin(a)] for a in 2.0 * np.pi * np.arange(360) / 360])


def correlated(rng: np.random.Generator, count: int, samples: float) -> Array:
    """A stationary Ornstein-Uhlenbeck process of unit variance round a closed curve, correlated over ``samples``."""
    lag = np.minimum(np.arange(count), count - np.arange(count))
    power = np.fft.rfft(np.exp(-lag / samples)).real
    return np.asarray(np.fft.irfft(np.sqrt(np.maximum(power, 0.0)) * np.fft.rfft(rng.normal(size=count)), n=count))


def noisy(ring: Array, rng: np.random.Generator, *, sigma_px: float, samples: float) -> Array:
    """An outline every pixel, displaced along its normal."""
    closed = np.concatenate([ring, ring[:1]])
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    where = np.arange(round(arc[-1])) * arc[-1] / round(arc[-1])
    points = np.column_stack([np.interp(where, arc, closed[:, i]) for i in range(2)])
    along = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
    return points + sigma_px * correlated(rng, len(points), samples)[:, None] * normal


def reach(points: Array) -> Array:
    """Support function (px) of a point set."""
    return np.asarray(np.max(points @ OUTWARD.T, axis=0))


@pytest.mark.parametrize(("sigma_px", "samples"), [(0.2, 0.01), (0.2, 3.0), (0.1, 6.0)])
def test_correlated_boundary_noise_is_measured_at_its_size(sigma_px: float, samples: float) -> None:
    """Smoothing takes less of correlated noise than it expects of white noise; the residuals of the fit put that right."""
    rng = np.random.default_rng(7)
    frames = world_poses(rng, 40)
    exact = [ellipsoid_outline(SEMI_AXES, HSV, pose) for pose in zip(frames.R, frames.t, strict=True)]
    first = silhouettes([Outline(noisy(ring, rng, sigma_px=sigma_px, samples=samples)) for ring in exact], [HSV] * len(exact))
    left = np.array([reach(first.points_px[first.slice_of(i)]) - reach(ring) for i, ring in enumerate(exact)])
    calibrated = ellipsoid_views(SEMI_AXES, rig(8))
    errors = tangency_errors(
        first, frames, calibrated.silhouettes, calibrated.poses, pivot_particle=np.zeros(3), offset_px=-float(left.mean())
    )
    noise = measured_noise(errors)
    assert np.sqrt(noise.mean_square) * first.sigma_px.mean() == pytest.approx(left.std(), rel=0.06)
    # Clipping at four *expected* deviations takes a tenth off where the noise is two and a half times what was expected.
    assert 0.88 * left.std() < with_noise(first, noise).sigma_px.mean() < 1.06 * left.std()
