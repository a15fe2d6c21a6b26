"""Shapes of outlines against closed forms: circles, flats and corners."""

import numpy as np
import pytest
from scipy.stats import norm

from estimator.geometry.outline_shape import ANGLES, BLURS_PX, outline_shape

WIDE = (BLURS_PX >= 1.0) & (BLURS_PX <= 8.0)
ANGLE = 2.0 * np.pi * np.arange(720) / 720


def circle(radius: float) -> np.ndarray:
    return 500.0 + radius * np.column_stack([np.cos(ANGLE), np.sin(ANGLE)])


SQUARE = np.array([[0.0, 0.0], [80.0, 0.0], [80.0, 80.0], [0.0, 80.0]])


def test_a_circle_has_its_radius_everywhere_and_recedes_by_half_the_square_over_it() -> None:
    shape = outline_shape([circle(40.0)])
    np.testing.assert_allclose(shape.radius_px, 40.0, rtol=0.03)
    wide = BLURS_PX[WIDE]
    np.testing.assert_allclose(shape.recession[0][:, WIDE], np.broadcast_to(wide / 80.0, (ANGLES, len(wide))), rtol=0.03, atol=5e-3)
    np.testing.assert_allclose(shape.sharpness, 1.0 / 80.0, atol=5e-3)


def test_which_way_round_does_not_matter() -> None:
    one, other = outline_shape([SQUARE]), outline_shape([SQUARE[::-1]])
    np.testing.assert_allclose(one.radius_px, other.radius_px)
    np.testing.assert_allclose(one.recession, other.recession, atol=1e-12)


def test_a_flat_side_stays_and_a_corner_recedes_with_the_blur() -> None:
    shape = outline_shape([SQUARE])
    side, corner = 0, ANGLES // 8
    assert np.all(np.abs(shape.recession[0, side, BLURS_PX <= 4.0]) < 1e-3)
    half = np.sqrt(2.0) * norm.ppf(np.sqrt(0.5))
    np.testing.assert_allclose(shape.recession[0, corner, (BLURS_PX >= 2.0) & WIDE], half, rtol=0.01)


def test_a_corner_knows_the_sides_that_meet_in_it() -> None:
    shape = outline_shape([SQUARE])
    assert shape.radius_px[0, ANGLES // 8] == 0.0
    np.testing.assert_allclose(shape.leak[0, ANGLES // 8, 2:], np.sqrt(2.0) * shape.leak[0, 0, 2:], rtol=0.02)


def test_between_directions_a_table_is_linear() -> None:
    shape = outline_shape([SQUARE])
    angle = 2.0 * np.pi * (ANGLES // 8 + np.array([0.0, 0.25, 1.0])) / ANGLES
    at = shape.towards(np.stack([np.cos(angle), np.sin(angle)], axis=-1)[None, :, None])
    np.testing.assert_allclose(at.erosion[0, 1, 0], 0.75 * at.erosion[0, 0, 0] + 0.25 * at.erosion[0, 2, 0])
    np.testing.assert_allclose(at.recession[0, 0, 0], shape.recession[0, ANGLES // 8])


def test_what_is_no_polygon_has_no_shape() -> None:
    shape = outline_shape([SQUARE[:2], SQUARE])
    assert not shape.radius_px[0].any()
    assert shape.take(np.array([1])).radius_px[0, 0] > 0


def test_corners_recede_further_than_sides_where_an_outline_is_drawn_too_tight() -> None:
    shape = outline_shape([SQUARE, circle(40.0)])
    side, corner = 0, ANGLES // 8
    np.testing.assert_allclose(shape.erosion[0, side], 1.0, atol=1e-9)
    np.testing.assert_allclose(shape.erosion[0, corner], np.sqrt(2.0), rtol=1e-6)
    np.testing.assert_allclose(shape.erosion[1], 1.0, atol=2e-3)


def test_a_spike_recedes_as_its_own_sides_do_and_not_as_its_hull() -> None:
    spike = np.array([[0.0, 0.0], [80.0, 0.0], [80.0, 40.0], [50.0, 40.0], [40.0, 60.0], [30.0, 40.0], [0.0, 40.0]])
    tip = ANGLES // 4
    half = np.arctan2(10.0, 20.0)
    shape = outline_shape([spike])
    np.testing.assert_allclose(shape.erosion[0, tip, :3], 1.0 / np.sin(half), rtol=1e-6)


@pytest.mark.parametrize("height_px", [3.0, 5.0, 12.0])
def test_a_leak_never_widens_a_narrow_outline_however_much_is_lost(height_px: float) -> None:
    """Once more is lost than there is, an outline moved point by point would have turned inside out."""
    ring = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, height_px], [0.0, height_px]])
    assert np.all(outline_shape([ring]).leak > 0.0)
