"""Closed curves sampled evenly."""

import numpy as np
import pytest

from estimator.geometry.closed_curves import area, nearest, resampled, through, unit_circle

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def test_steps_are_equal_around_the_whole_curve() -> None:
    found = resampled(SQUARE, 0.5, fewest=3)
    assert len(found) == 32
    np.testing.assert_allclose(np.linalg.norm(np.roll(found, -1, axis=0) - found, axis=1), 0.5)
    np.testing.assert_allclose(found[0], SQUARE[0])


def test_there_are_enough_points() -> None:
    assert len(resampled(SQUARE, 10.0, fewest=8)) == 8


def test_directions_go_round_once() -> None:
    np.testing.assert_allclose(unit_circle(4), [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], atol=1e-15)


def test_a_curve_through_points_of_a_circle_is_the_circle() -> None:
    corners = 10.0 * unit_circle(60)
    curve = through(corners, 2)
    np.testing.assert_array_equal(curve[::4], corners)
    assert np.abs(np.linalg.norm(curve, axis=1) - 10.0).max() < 1e-4
    assert area(curve) == pytest.approx(100.0 * np.pi, rel=(2.0 * np.pi / 240) ** 2 / 5.0)


@pytest.mark.parametrize("size", [0.3, 1.0, 50.0])
def test_the_nearest_point_is_found_whatever_the_buckets(size: float) -> None:
    rng = np.random.default_rng(3)
    curve, points = rng.normal(size=(300, 2)), 3.0 * rng.normal(size=(40, 2))
    far = np.linalg.norm(points[:, None] - curve, axis=2)
    np.testing.assert_array_equal(nearest(curve, points, size), far.argmin(axis=1))
