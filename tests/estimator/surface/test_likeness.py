"""Residuals that stay at a place of the outline from frame to frame count as fewer; white ones do not."""

import numpy as np
from scipy.ndimage import uniform_filter1d

from estimator.surface.likeness import alike_in_time

FRAMES, SAMPLES, LASTS = 100, 120, 9


def outlines() -> tuple[np.ndarray, ...]:
    """Round ones."""
    angle = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    return (20.0 * np.column_stack([np.cos(angle), np.sin(angle)]) + 300.0,) * FRAMES


CAMERA = np.zeros(FRAMES, dtype=np.int64)


def test_white_residuals_are_as_many_as_they_are() -> None:
    gap = np.random.default_rng(1).normal(size=(FRAMES, SAMPLES))
    assert 1.0 <= alike_in_time(gap.ravel(), outlines(), CAMERA) < 1.2


def test_residuals_that_last_count_as_fewer() -> None:
    gap = uniform_filter1d(np.random.default_rng(2).normal(size=(FRAMES, SAMPLES)), LASTS, axis=0)
    assert 0.7 * LASTS < alike_in_time(gap.ravel(), outlines(), CAMERA) < 1.3 * LASTS
