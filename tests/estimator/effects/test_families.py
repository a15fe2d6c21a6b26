"""Empirical families: what their curves and fields can follow."""

import numpy as np
import pytest

from estimator.effects.empirical.families import ForceField, ZoomInTime
from estimator.effects.empirical.plane_field import PlaneField, plane_field_like
from estimator.effects.link import Moment, Setting

SETTING = Setting(np.arange(80) / 4000.0, 5e-5, np.zeros(3), np.ones(3))


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


def test_a_plane_field_takes_over_from_a_linear_one() -> None:
    """Of a wall's force, which falls with the square of the distance, the field that is linear in the place misses six times as much."""
    rng = np.random.default_rng(4)
    place = np.array([0.0, 0.0, 0.6]) + rng.uniform(-0.03, 0.03, (300, 3))
    towards = np.array([0.6, -0.64, 0.48])
    wall = towards / (0.09 + place @ towards - 0.288)[:, None] ** 2 * 0.02
    field = ForceField(place.mean(axis=0))
    theta = np.linalg.lstsq(_columns(field, place), wall.ravel(), rcond=None)[0]
    linear = field.force(np.tile(theta, (len(place), 1)), place)
    plane, values = plane_field_like(linear, place)
    assert abs(plane.axes[0] @ towards) == pytest.approx(1.0, abs=2e-3)
    columns = np.stack([_force(plane, values + step, place) - _force(plane, values, place) for step in 1e-6 * np.eye(7)], axis=-1) / 1e-6
    better = values + np.linalg.lstsq(columns.reshape(-1, 7), (wall - _force(plane, values, place)).ravel(), rcond=None)[0]
    errors = [np.abs(found - wall).max() for found in (linear, _force(plane, better, place))]
    assert errors[1] < errors[0] / 6.0


def _columns(field: ForceField, place: np.ndarray) -> np.ndarray:
    return np.stack([field.force(np.tile(unit, (len(place), 1)), place).ravel() for unit in np.eye(9)], axis=-1)


def _force(plane: PlaneField, theta: np.ndarray, place: np.ndarray) -> np.ndarray:
    still = np.zeros_like(place)
    moment = Moment(0.0, place, still, still, still, np.zeros((len(place), 3, 3)))
    return plane.acceleration(np.tile(theta, (len(place), 1)), moment, SETTING)
