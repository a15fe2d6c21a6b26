"""Empirical families: what their curves can follow."""

import numpy as np
import pytest

from estimator.effects.empirical.families import ZoomInTime


@pytest.mark.parametrize("sevenths", [1.0, 2.0, 7.0])
def test_a_zoom_follows_a_relaxation(sevenths: float) -> None:
    """Of a seventh of the recording and longer ones, within a thousandth; every curve starts from zero and stands still at the end."""
    zoom = ZoomInTime().over(0.04)
    times = np.linspace(0.0, 0.04, 200)
    relaxing = -np.expm1(-7.0 * times / (sevenths * 0.04))
    A = zoom.growth(times)
    left = relaxing - A @ np.linalg.lstsq(A, relaxing, rcond=None)[0]
    assert np.abs(left).max() < 1e-3
    np.testing.assert_allclose(zoom.growth(np.array([0.0])), 0.0, atol=1e-12)
    np.testing.assert_allclose(zoom.growth(np.array([0.05])), zoom.growth(np.array([0.04])))
