"""The predicted bias of outlines against drawn outlines, and its way into the errors."""

import numpy as np
import pytest

from estimator.geometry.epipolar_tangency import empty_errors
from estimator.geometry.outline_bias import (
    DIRECTIONS,
    OutlineBias,
    bias_curves,
    curve_at,
    outward_directions,
    supports,
    without_bias,
)
from estimator.geometry.silhouettes import pack
from estimator.geometry.tangent_hull import tangent_hull
from tests.estimator.exact import HSV

SIDE, NOISE = 40.0, 0.2
SQUARE = np.array([[0.0, 0.0], [SIDE, 0.0], [SIDE, SIDE], [0.0, SIDE]]) + 100.0


def _noisy_square(rng: np.random.Generator) -> np.ndarray:
    arc = np.arange(160.0) + rng.random()
    corner = np.vstack([SQUARE, SQUARE[:1]])
    points = np.column_stack([np.interp(arc % 160.0, np.arange(5) * SIDE, corner[:, a]) for a in range(2)])
    chord = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    normal = np.column_stack([chord[:, 1], -chord[:, 0]]) / np.linalg.norm(chord, axis=1, keepdims=True)
    return points + normal * rng.normal(0.0, NOISE, (160, 1))


def test_prediction_is_the_mean_over_drawn_outlines() -> None:
    rng = np.random.default_rng(5)
    outward = outward_directions()
    drawn = np.mean([(tangent_hull(_noisy_square(rng)).points_px @ outward.T).max(axis=0) for _ in range(400)], axis=0)
    truth = (SQUARE @ outward.T).max(axis=0)
    predicted = bias_curves([SQUARE], NOISE, np.array([160]), pairs=200, rng=rng)[0]
    # Tangents scatter by about 0.15 px: over 400 draws by 0.008 px.
    assert np.abs(predicted - (drawn - truth)).max() < 0.04
    assert predicted[0] > 0.1, "the hull of a noisy flat side is fat"
    assert predicted[DIRECTIONS // 8] < -0.02, "the smoothed corner is cut"


def test_without_noise_only_corners_are_biased() -> None:
    circle = 100.0 + 60.0 * outward_directions()
    both = bias_curves([SQUARE, circle], 0.0, np.array([160, 377]), pairs=2, rng=np.random.default_rng(0))
    assert both[0, DIRECTIONS // 8] < -0.02
    assert np.abs(both[1]).max() < 0.02


def test_outlines_not_seen_have_no_bias() -> None:
    predicted = bias_curves([SQUARE, np.zeros((0, 2))], NOISE, np.array([0, 50]), pairs=2, rng=np.random.default_rng(0))
    assert not predicted.any()


def test_supports_are_those_of_the_hulls() -> None:
    hull = tangent_hull(_noisy_square(np.random.default_rng(1)))
    values = supports(pack([hull, tangent_hull(np.zeros((0, 2)))], [HSV, HSV]))
    assert values[0] == pytest.approx((hull.points_px @ outward_directions().T).max(axis=0))
    assert not values[1].any()


def test_curves_are_linear_between_directions() -> None:
    curve = np.arange(DIRECTIONS, dtype=float)[None]
    angle = 2.0 * np.pi * np.array([3.0, 3.25, DIRECTIONS - 0.5]) / DIRECTIONS
    values = curve_at(curve, np.zeros(3, dtype=np.int64), np.column_stack([np.cos(angle), np.sin(angle)]))
    assert values == pytest.approx([3.0, 3.25, (DIRECTIONS - 1) / 2.0])


def test_errors_lose_own_bias_and_the_views_in_the_sightings_pixels() -> None:
    errors = empty_errors(2, 3)
    errors.valid[:] = True
    errors.valid[1, 2] = False
    errors.direction[:, :, :, 0] = 1.0
    errors.jacobian[:, :, :2, 7] = -0.2
    own, view = np.full((2, DIRECTIONS), 0.1), np.full((3, DIRECTIONS), 0.3)
    bias = OutlineBias(own=own, view=view)
    left = without_bias(errors, bias)
    assert left.error[0, 0, :2] == pytest.approx(-(0.1 - 0.2 * 0.3))
    assert not left.error[1, 2].any()
    assert not left.error[:, :, 2:].any()
    assert without_bias(errors, None) is errors
    assert bias.take(np.array([1])).own.shape == (1, DIRECTIONS)
