"""The stated noise is the noise there is."""

import numpy as np
import pytest
import shapely

from datasets.vocabulary.outline import signed_area
from synth.silhouette import noisy_outline
from synth.silhouette.noisy_outline import noise_spectrum, samples_with_normals

ANGLES = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
CIRCLE = 300 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]) + 500


def test_samples_lie_on_the_outline_at_equal_steps() -> None:
    samples, normals = samples_with_normals(CIRCLE, spacing_px=1.0, phase=0.3)
    steps = np.linalg.norm(np.roll(samples, -1, axis=0) - samples, axis=1)
    assert steps == pytest.approx(np.full(len(samples), 2 * np.pi * 300 / len(samples)), rel=1e-3)
    assert len(samples) == round(shapely.linearrings(CIRCLE).length)
    assert shapely.distance(shapely.linearrings(CIRCLE), shapely.points(samples)).max() < 1e-9
    outward = (samples - 500) / np.linalg.norm(samples - 500, axis=1, keepdims=True)
    assert np.sum(outward * normals, axis=1).min() > 0.9999


@pytest.mark.parametrize("sigma", [0.05, 0.2, 0.5])
def test_displacements_are_white_normal_noise_of_the_stated_size(sigma: float) -> None:
    outline = noisy_outline(CIRCLE, spacing_px=1.0, sigma_px=sigma, rng=np.random.default_rng(1))
    off = np.linalg.norm(outline.points_px - 500, axis=1) - 300
    n = len(off)
    # Four standard errors each.
    assert abs(off.mean()) < 4 * sigma / np.sqrt(n)
    assert abs(off.std() - sigma) < 4 * sigma / np.sqrt(2 * n)
    assert abs(np.corrcoef(off, np.roll(off, 1))[0, 1]) < 4 / np.sqrt(n)
    assert abs(np.mean((off / sigma) ** 4) - 3) < 4 * np.sqrt(96 / n)


@pytest.mark.parametrize("correlation", [0.5, 3.0])
def test_correlated_displacements_have_the_stated_size_and_correlation(correlation: float) -> None:
    rng = np.random.default_rng(4)
    outlines = [noisy_outline(CIRCLE, spacing_px=1.0, sigma_px=0.2, rng=rng, correlation_px=correlation).points_px for _ in range(20)]
    off = np.stack([np.linalg.norm(points - 500, axis=1) - 300 for points in outlines])
    # Four standard errors; neighbours that are alike count as fewer.
    n = off.size * np.tanh(0.5 / correlation)
    assert off.std() == pytest.approx(0.2, abs=0.2 * 4 / np.sqrt(2 * n))
    for lag in (1, 3, 10):
        alike = np.mean(off * np.roll(off, lag, axis=1)) / 0.2**2
        assert alike == pytest.approx(np.exp(-lag / correlation), abs=4 * np.sqrt(2 / n))


@pytest.mark.parametrize("correlation", [0.0, 0.1, 3.0, 1000.0])
def test_the_spectrum_is_that_of_a_covariance(correlation: float) -> None:
    for count in (8, 9, 200):
        spectrum = noise_spectrum(count, sigma_px=0.3, correlation_steps=correlation)
        assert spectrum.min() > 0
        assert spectrum.mean() == pytest.approx(0.3**2)


def test_no_noise_leaves_points_on_the_outline() -> None:
    outline = noisy_outline(CIRCLE, spacing_px=2.0, sigma_px=0.0, rng=np.random.default_rng(1))
    assert shapely.distance(shapely.linearrings(CIRCLE), shapely.points(outline.points_px)).max() < 1e-9
    assert signed_area(outline.points_px) == pytest.approx(signed_area(CIRCLE), rel=1e-4)


def test_the_same_stream_gives_the_same_outline() -> None:
    a, b = (noisy_outline(CIRCLE, spacing_px=1.0, sigma_px=0.2, rng=np.random.default_rng(9)) for _ in range(2))
    np.testing.assert_array_equal(a.points_px, b.points_px)
