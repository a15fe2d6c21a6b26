"""Hollows of bodies are told from those that noise alone leaves in the outlines of convex ones."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.geometry.hollows import hollow_beyond_noise, hollow_share
from estimator.particle.particle import LEAST_HOLLOW
from synth.silhouette.noisy_outline import noisy_outline

Array = NDArray[np.float64]
ANGLE = 2.0 * np.pi * np.arange(2000) / 2000
OUTLINES = 20


def seen(exact: Array, noise_px: float) -> list[Array]:
    rng = np.random.default_rng(3)
    return [noisy_outline(exact, spacing_px=1.0, sigma_px=noise_px, rng=rng).points_px for _ in range(OUTLINES)]


@pytest.mark.parametrize("noise_px", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("width_px", [30.0, 60.0, 300.0])
@pytest.mark.parametrize("slender", [1.0, 2.3])
def test_a_convex_body_has_none_however_coarse_and_noisy_its_views_are(width_px: float, slender: float, noise_px: float) -> None:
    exact = 0.5 * width_px * np.column_stack([np.sqrt(slender) * np.cos(ANGLE), np.sin(ANGLE) / np.sqrt(slender)])
    assert abs(hollow_beyond_noise(seen(exact, noise_px))) < 0.4 * LEAST_HOLLOW


@pytest.mark.parametrize("noise_px", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("depth", [0.09, 0.12])
def test_lobes_have_theirs(depth: float, noise_px: float) -> None:
    exact = 60.0 * (1.0 + depth * np.cos(5.0 * ANGLE))[:, None] * np.column_stack([np.cos(ANGLE), np.sin(ANGLE)])
    assert hollow_beyond_noise(seen(exact, noise_px)) == pytest.approx(hollow_share([exact]), rel=0.25)
    assert hollow_beyond_noise(seen(exact, noise_px)) > LEAST_HOLLOW


def test_nothing_seen_is_not_hollow() -> None:
    assert hollow_beyond_noise([np.zeros((0, 2)), np.eye(2)]) == 0.0
