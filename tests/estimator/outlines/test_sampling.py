"""Polygons become even samples; even samples stay as they are."""

import numpy as np

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.outlines.recording import checked
from estimator.outlines.sampling import evenly_sampled
from synth.silhouette.noisy_outline import noisy_outline

CORNERS = np.array([[100.0, 100.0], [160.3, 108.0], [172.0, 150.5], [120.0, 181.0]])


def steps(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)


def with_corners() -> np.ndarray:
    """Samples a pixel apart and the four corners among them."""
    parts = []
    for corner, following in zip(CORNERS, np.roll(CORNERS, -1, axis=0), strict=True):
        along = np.append(0.0, np.arange(0.3, np.linalg.norm(following - corner), 1.0)) / np.linalg.norm(following - corner)
        parts.append(corner + along[:, None] * (following - corner))
    return np.vstack(parts)


def test_corners_alone_are_sampled() -> None:
    corners = np.vstack([CORNERS[:3], [[140.0, 175.0]], CORNERS[3:]])
    assert len(evenly_sampled(corners)) > 200
    assert np.ptp(steps(evenly_sampled(corners))[:-1]) < 0.6


def test_corners_among_even_samples_are_sampled_anew() -> None:
    points = with_corners()
    assert steps(points).min() < 0.5 * np.median(steps(points))
    assert steps(checked(Outline(points), Intrinsics(512, 512, 1e3, 1e3, 255.5, 255.5)).outline.points_px).min() > 0.6


def test_a_camera_s_outline_stays_as_it_is() -> None:
    for seed in range(20):
        points = noisy_outline(CORNERS, spacing_px=1.0, sigma_px=0.2, rng=np.random.default_rng(seed)).points_px
        assert evenly_sampled(points) is points
