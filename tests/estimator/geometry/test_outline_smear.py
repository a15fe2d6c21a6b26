"""What smeared outlines lose at corners, against closed forms."""

import numpy as np
import pytest

from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.outline_smear import LEVELS, smear_losses

WAY = 6.0
RIGHT = np.array([[0.0, 0.0], [0.0, 0.0], [WAY, 0.0]])
"""Every point moves to the right."""
OUTWARD = unit_circle(144)
CUT_PX = 5e-8
"""Corners of polygons that are cut are rounded to 1e-8 px."""
UP, DOWN, TO_THE_RIGHT = 36, 108, 0


def wedge(half_angle_deg: float) -> np.ndarray:
    """A long spike that points up."""
    half = 200.0 * np.tan(np.radians(half_angle_deg))
    return np.array([[-half, 0.0], [half, 0.0], [0.0, 200.0]])


@pytest.mark.parametrize("half_angle_deg", [10.0, 30.0, 45.0])
def test_a_spike_across_the_motion_loses_what_is_narrower_than_the_dark_share(half_angle_deg: float) -> None:
    losses = smear_losses(wedge(half_angle_deg), RIGHT, OUTWARD)
    np.testing.assert_allclose(losses[UP], LEVELS * WAY / (2.0 * np.tan(np.radians(half_angle_deg))), atol=CUT_PX)


def test_sides_and_spikes_along_the_motion_lose_nothing() -> None:
    losses = smear_losses(wedge(20.0), RIGHT, OUTWARD)
    np.testing.assert_allclose(losses[DOWN], 0.0, atol=CUT_PX)
    np.testing.assert_allclose(smear_losses(wedge(20.0)[:, ::-1], RIGHT, OUTWARD)[TO_THE_RIGHT], 0.0, atol=CUT_PX)


def test_what_does_not_move_loses_nothing() -> None:
    np.testing.assert_allclose(smear_losses(wedge(20.0), np.zeros((3, 2)), OUTWARD), 0.0, atol=CUT_PX)


def test_an_outline_that_is_gone_keeps_the_loss_of_the_level_before() -> None:
    thin = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 50.0], [0.0, 50.0]])
    losses = smear_losses(thin, RIGHT, OUTWARD)
    assert np.isfinite(losses).all()
    np.testing.assert_array_equal(losses[:, -1], losses[:, -2])
