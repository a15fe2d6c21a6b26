"""Smoothing and hulls of noisy outlines: what is left of the noise, how far the hull is biased, and what is expected of both."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import lstsq
from scipy.signal import savgol_coeffs, savgol_filter

from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.tangent_hull import (
    NOISE_FLOOR_PX,
    WINDOW,
    Likeness,
    TangentHull,
    degraded_hull,
    normals,
    smoothing_weights,
    tangent_hull,
)

Array = NDArray[np.float64]
RADIUS_PX, SIGMA_PX, DRAWS = 30.0, 0.2, 60
ANGLES = 2.0 * np.pi * np.arange(180) / 180
OUTWARD = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
MIDDLE = np.array([200.3, 150.7])


def circle(spacing_px: float = 1.0, radius_px: float = RADIUS_PX, phase: float = 0.0) -> tuple[Array, Array]:
    """Samples and outward normals."""
    count = round(2.0 * np.pi * radius_px / spacing_px)
    angle = 2.0 * np.pi * (np.arange(count) + phase) / count
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    return MIDDLE + radius_px * normal, normal


def noisy_circle(rng: np.random.Generator, sigma_px: float = SIGMA_PX) -> Array:
    points, normal = circle(phase=rng.random())
    return points + normal * rng.normal(scale=sigma_px, size=(len(points), 1))


def polygon(side_px: float, sides: int) -> Array:
    """A regular polygon sampled every pixel, not at its corners."""
    corners = side_px / (2.0 * np.sin(np.pi / sides)) * np.exp(2j * np.pi * np.arange(sides) / sides)
    share = (np.arange(round(side_px)) + 0.5) / round(side_px)
    ring = (corners[:, None] + (np.roll(corners, -1) - corners)[:, None] * share).ravel()
    return MIDDLE + np.column_stack([ring.real, ring.imag])


def support(points: Array) -> Array:
    """Distance (px) of the tangent in each of ``ANGLES`` from the middle."""
    return np.max((points - MIDDLE) @ OUTWARD.T, axis=0)


@pytest.fixture(scope="module")
def hulls() -> list[TangentHull]:
    rng = np.random.default_rng(0)
    return [tangent_hull(noisy_circle(rng)) for _ in range(DRAWS)]


def test_an_exact_circle_stays_where_it_is() -> None:
    hull = tangent_hull(circle()[0])
    assert np.abs(support(hull.points_px) - RADIUS_PX).max() < 0.01
    assert hull.noise_px < 0.005
    np.testing.assert_allclose(hull.sigma_px, NOISE_FLOOR_PX, rtol=0.05)


@pytest.mark.parametrize("sigma_px", [0.1, 0.2, 0.4])
def test_the_point_noise_is_the_noise_put_in(sigma_px: float) -> None:
    rng = np.random.default_rng(1)
    seen = [tangent_hull(noisy_circle(rng, sigma_px)).noise_px for _ in range(40)]
    assert np.mean(seen) == pytest.approx(sigma_px, rel=0.06)


def test_smoothing_takes_noise_and_fat_off(hulls: list[TangentHull]) -> None:
    rng = np.random.default_rng(0)
    raw = np.array([support(noisy_circle(rng)) for _ in range(DRAWS)]) - RADIUS_PX
    smooth = np.array([support(h.points_px) for h in hulls]) - RADIUS_PX
    # Twenty independent tangents a hull and sixty hulls: means are good to 0.004 px.
    assert raw.mean() == pytest.approx(0.22, abs=0.015)
    assert smooth.mean() == pytest.approx(0.11, abs=0.015)
    assert 0.09 < smooth.std(axis=0).mean() < 0.9 * raw.std(axis=0).mean()


def test_a_longer_window_is_less_fat_and_cuts_corners(hulls: list[TangentHull]) -> None:
    rng = np.random.default_rng(3)
    long = np.array([support(tangent_hull(noisy_circle(rng), window=9).points_px) for _ in range(DRAWS)]) - RADIUS_PX
    assert long.mean() < 0.5 * np.mean([support(h.points_px) - RADIUS_PX for h in hulls])
    square = polygon(40.0, 4)
    short_cut, long_cut = (support(square) - support(tangent_hull(square, window=w).points_px) for w in (WINDOW, 9))
    assert short_cut.max() < 0.08
    assert long_cut.max() > 3.0 * short_cut.max()


def test_the_expected_noise_is_no_less_than_what_is_left(hulls: list[TangentHull]) -> None:
    """Taking extremes among neighbours lowers the noise, so the filter's own factor is an upper bound, and not a loose one."""
    left = np.array([support(h.points_px) for h in hulls]).std(axis=0).mean()
    expected = np.mean([h.sigma_px.mean() for h in hulls])
    assert left < expected < 1.6 * left


def test_tangents_further_apart_than_a_window_are_independent(hulls: list[TangentHull]) -> None:
    z = np.array([support(h.points_px) for h in hulls])
    z -= z.mean(axis=0)
    lag_of_a_window = round(len(ANGLES) * WINDOW / hulls[0].samples)
    near, far = (np.mean(z * np.roll(z, -lag, axis=1)) / np.mean(z * z) for lag in (1, 2 * lag_of_a_window))
    assert near > 0.8
    assert abs(far) < 0.08


def test_a_fine_outline_made_like_a_coarse_one_has_its_bias(hulls: list[TangentHull]) -> None:
    fine = MIDDLE + 4.0 * (circle(0.25)[0] - MIDDLE)
    like = degraded_hull(fine, Likeness(spacing_px=4.0, noise_px=4.0 * SIGMA_PX), np.random.default_rng(5))
    own = np.mean(support(like.points_px) / 4.0 - RADIUS_PX)
    assert own == pytest.approx(np.mean([support(h.points_px) - RADIUS_PX for h in hulls]), abs=0.012)
    assert own > 0.08


def test_drawing_all_coarse_outlines_at_once_is_drawing_one_after_the_other() -> None:
    """To the last bit: a particle's estimates are the same as before, which drew them so."""
    fine, like = noisy_circle(np.random.default_rng(7), 0.05), Likeness(spacing_px=3.0, noise_px=0.6)
    found = degraded_hull(fine, like, np.random.default_rng(8))
    outward, rng, total = unit_circle(like.directions), np.random.default_rng(8), np.zeros((like.directions, 2))
    extra, count = np.sqrt(like.noise_px**2 - found.noise_px**2), round(len(fine) / 3)
    for draw in range(like.draws):
        where = (np.arange(count) + draw / like.draws) * (len(fine) / count)
        low = where.astype(np.int64)
        coarse = (1.0 - (where - low)[:, None]) * fine[low] + (where - low)[:, None] * fine[(low + 1) % len(fine)]
        noisy = coarse + normals(coarse) * (extra * rng.standard_normal((count, 1)))
        smooth = savgol_filter(noisy, WINDOW, 2, axis=0, mode="wrap")
        total += smooth[np.argmax(smooth @ outward.T, axis=0)]
    np.testing.assert_array_equal(found.points_px, total / like.draws)


def test_the_smoothing_weights_are_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Making them anew took half the time of smoothing an outline."""
    rng = np.random.default_rng(2)
    degraded_hull(noisy_circle(rng), Likeness(4.0, 0.8), rng)
    made = []
    monkeypatch.setattr("estimator.geometry.tangent_hull.lstsq", lambda *given: made.append(given) or lstsq(*given))
    tangent_hull(noisy_circle(rng))
    degraded_hull(noisy_circle(rng), Likeness(4.0, 0.8), rng)
    assert made == []


@pytest.mark.parametrize("window", [5, 9, 31])
def test_the_smoothing_weights_are_those_of_savitzky_and_golay(window: int) -> None:
    np.testing.assert_allclose(smoothing_weights(window), savgol_coeffs(window, 2), rtol=1e-12, atol=1e-16)


def test_uneven_and_coarse_outlines_are_resampled() -> None:
    coarse = circle(4.0, phase=0.3)[0]
    hull = tangent_hull(coarse)
    assert hull.samples == pytest.approx(2.0 * np.pi * RADIUS_PX, abs=2)
    # Chords of 4 px of this circle lie up to 0.07 px inside.
    assert np.abs(support(hull.points_px) - RADIUS_PX).max() < 0.1
    corners = MIDDLE + 40.0 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    assert tangent_hull(corners).samples == 160


@pytest.mark.parametrize("points", [np.zeros((0, 2)), np.zeros((2, 2)), np.ones((50, 2)), np.column_stack([np.arange(50.0)] * 2) * [1, 0]])
def test_an_outline_without_area_has_no_hull(points: Array) -> None:
    assert len(tangent_hull(points).points_px) == 0
    assert len(degraded_hull(points, Likeness(4.0, 0.8), np.random.default_rng(0)).points_px) == 0
