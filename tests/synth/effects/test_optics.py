"""Cameras that are not what the observation states."""

import cv2
import numpy as np
import pytest

from datasets.vocabulary.camera import Intrinsics
from synth.silhouette import blurred, grid_around, level_outline, mean_coverage

STATED = Intrinsics(1024, 768, 6000.0, 6100.0, 511.5, 383.5, (0.2, 3.0, 1e-3, -1e-3, 0.5))
PLAIN = Intrinsics(1024, 768, 6000.0, 6000.0, 511.5, 383.5)
POINTS = np.column_stack([np.random.default_rng(1).uniform(-0.04, 0.04, (40, 2)), np.full(40, 0.6)]) * [1.0, 1.0, 1.0]
CENTRE = np.array([511.5, 383.5])


def test_radial_distortion_moves_points_radially(in_force) -> None:
    bent = in_force("radial_distortion", k1=2.0).lens(PLAIN).project(POINTS) - CENTRE
    ideal = PLAIN.project(POINTS) - CENTRE
    np.testing.assert_allclose(bent[:, 0] * ideal[:, 1], bent[:, 1] * ideal[:, 0], atol=1e-9)
    r = np.linalg.norm(ideal, axis=1)
    np.testing.assert_allclose(np.linalg.norm(bent, axis=1) - r, 2.0 * r**3 / 6000.0**2, rtol=1e-9)


@pytest.mark.parametrize(
    ("key", "values", "place"),
    [("radial_distortion", {"k1": 0.7, "k2": -20.0}, (0, 1)), ("tangential_distortion", {"p1": 2e-3, "p2": -3e-3}, (2, 3))],
)
def test_distortion_adds_to_the_stated_one_as_opencv_has_it(in_force, key: str, values: dict[str, float], place: tuple[int, int]) -> None:
    bent = in_force(key, **values).lens(STATED).project(POINTS)
    coefficients = np.array(STATED.distortion)
    coefficients[list(place)] += list(values.values())
    expected, _ = cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), STATED.K, coefficients)
    np.testing.assert_allclose(bent, expected[:, 0], atol=1e-9)


def test_the_principal_point_shifts_the_picture(in_force) -> None:
    shifted = in_force("principal_point", dx=3.0, dy=-2.0).lens(STATED).project(POINTS)
    np.testing.assert_allclose(shifted - STATED.project(POINTS), [[3.0, -2.0]] * 40, atol=1e-10)


def test_pixel_aspect_stretches_downwards_only(in_force) -> None:
    stretched = in_force("pixel_aspect", relative=0.01).lens(STATED).project(POINTS) - CENTRE
    np.testing.assert_allclose(stretched, (STATED.project(POINTS) - CENTRE) * [1.0, 1.01], atol=1e-10)


def test_focal_length_scales_about_the_principal_point(in_force) -> None:
    scaled = in_force("focal_length", relative=-0.05).lens(STATED).project(POINTS) - CENTRE
    np.testing.assert_allclose(scaled, 0.95 * (STATED.project(POINTS) - CENTRE), atol=1e-10)


def test_vibration_is_periodic_and_of_no_mean(in_force) -> None:
    effect = in_force("camera_vibration", sine_x=1.5, cosine_y=-0.7, frequency=200.0)
    times = np.arange(40) / 4000
    shift = effect.sway(times).shift_px
    np.testing.assert_allclose(shift[:20], shift[20:], atol=1e-12)
    np.testing.assert_allclose(shift[:20].mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(shift[:10], -shift[10:20], atol=1e-12)
    np.testing.assert_allclose(shift[5], [1.5, 0.0], atol=1e-12)
    px = effect.camera_at(STATED, times[5]).project(POINTS)
    np.testing.assert_allclose(px - STATED.project(POINTS), [[1.5, 0.0]] * 40, atol=1e-9)


def test_a_warming_lens_settles(in_force) -> None:
    effect = in_force("thermal_focus_drift", relative=0.02, time_constant=0.01)
    scale = effect.sway(np.array([0.0, 0.01 * np.log(2), 10.0])).scale
    np.testing.assert_allclose(scale, [1.0, 1.01, 1.02], atol=1e-12)
    px = effect.camera_at(STATED, 10.0).project(POINTS) - CENTRE
    np.testing.assert_allclose(px, 1.02 * (STATED.project(POINTS) - CENTRE), atol=1e-9)


def test_several_motions_of_the_picture_add_up(in_force) -> None:
    both = type(in_force("gravity"))(
        {**in_force("thermal_focus_drift", relative=0.02, time_constant=0.01).values, **in_force("camera_vibration", cosine_x=1.0).values}
    )
    sway = both.sway(np.array([0.02]))
    assert sway.scale[0] == pytest.approx(1 + 0.02 * (1 - np.exp(-2)))
    np.testing.assert_allclose(sway.shift_px, [[1.0, 0.0]])


def test_blur_grows_on_both_sides_of_the_focal_plane(in_force) -> None:
    effect = in_force("defocus_growth", blur=80.0)
    np.testing.assert_allclose(effect.sigma_px(np.array([-0.01, 0.0, 0.01, 0.02])), [0.8, 0.0, 0.8, 1.6])


@pytest.mark.parametrize("radius", [10.0, 30.0])
def test_a_blurred_disk_recedes_with_its_curvature(radius: float) -> None:
    """Half level of a blurred disk: ``-s² / (2 rho)`` to second order, with a remainder of order ``s⁴ / rho³``."""
    angle = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    disk = radius * np.column_stack([np.cos(angle), np.sin(angle)]) + 50.3
    grid = grid_around(disk, 12.0, 8)
    outline = level_outline(blurred(mean_coverage([disk], grid), 2.0 * 8), grid, 0.5)
    recession = np.linalg.norm(outline - 50.3, axis=1) - radius
    assert recession.mean() == pytest.approx(-(2.0**2) / (2 * radius), abs=3 * 2.0**4 / radius**3 + 1e-3)
    assert recession.std() < 2e-3


def test_blur_leaves_straight_edges_where_they_are() -> None:
    square = 20.0 * np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]) + 5.37
    grid = grid_around(square, 10.0, 8)
    outline = level_outline(blurred(mean_coverage([square], grid), 1.0 * 8), grid, 0.5)
    left = outline[(np.abs(outline[:, 1] - 15.37) < 4) & (outline[:, 0] < 10)]
    np.testing.assert_allclose(left[:, 0], 5.37, atol=2e-3)
    assert np.hypot(*(outline - 5.37).T).min() > 0.5
