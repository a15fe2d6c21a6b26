"""Blur of focus and of motion has the width that theory gives; crops agree with whole pictures; reruns agree to the last bit."""

import numpy as np
import pytest

from synth.rendering.camera import ThinLens, blur_radius_px
from synth.rendering.exposure import background_light, compose, subframe_times
from synth.rendering.window import Window, whole_picture

MIDDLE_ROWS = slice(34, 46)


def edge_variance(coverage: np.ndarray) -> float:
    """Variance (px²) of the line spread function of the plate's left edge, that of the pixel itself taken off."""
    profile = coverage[MIDDLE_ROWS, :48].mean(axis=0)
    spread = np.clip(np.diff(profile), 0, None)
    x = np.arange(len(spread))
    mean = (spread @ x) / spread.sum()
    return float(spread @ (x - mean) ** 2 / spread.sum()) - 1 / 12


def test_defocus_spreads_an_edge_like_a_disk(room, pose, plate) -> None:
    lens = ThinLens(4e-3, 0.6)
    radius = blur_radius_px(lens, 6000.0, 0.5)
    coverage = room(plate, lens=lens).take([pose(z_m=0.5)], samples=256).coverage
    assert radius == pytest.approx(8.0)
    assert edge_variance(coverage) == pytest.approx(radius**2 / 4, rel=0.05)


def test_motion_spreads_an_edge_by_its_length(room, pose, plate) -> None:
    times = subframe_times(2.0, 1e-4, 16, np.random.default_rng(0))
    length_px = 12.0
    poses = [pose(x_mm=0.1 * length_px * (time - 2.0) / 1e-4) for time in times]
    coverage = room(plate).take(poses, samples=16).coverage
    assert edge_variance(coverage) == pytest.approx(length_px**2 / 12, rel=0.1)


@pytest.mark.parametrize("count", [1, 7, 8])
def test_subframes_are_stratified_and_their_mean_is_the_frame_s_time(count: int) -> None:
    times = subframe_times(1.0, count * 1e-5, count, np.random.default_rng(3))
    parts = np.floor((times - 1.0) / 1e-5 + 0.5 * count)
    np.testing.assert_array_equal(parts, np.arange(count))
    assert times.mean() == pytest.approx(1.0, abs=1e-12)


def test_a_crop_in_the_background_is_the_whole_picture(room, pose, pebble) -> None:
    dark_room = room(pebble, lens=ThinLens(3e-3, 0.6))
    optics, samples = dark_room.optics, 16
    crop = Window(25, 20, 46, 40)
    background = background_light(optics)
    cropped = compose(optics, background, crop, dark_room.take([pose()], samples=samples, window=crop, seed=1))
    whole = compose(optics, background, whole_picture(optics.intrinsics), dark_room.take([pose()], samples=samples, seed=2))
    outside = np.ones(whole.shape, dtype=bool)
    outside[crop.slices] = False
    np.testing.assert_allclose(cropped[outside], whole[outside], rtol=1e-12)
    again = compose(optics, background, whole_picture(optics.intrinsics), dark_room.take([pose()], samples=samples, seed=3))
    noise = np.std((whole - again)[crop.slices])
    assert 0 < np.std((whole - cropped)[crop.slices]) < 1.25 * noise
    assert abs(np.mean((whole - cropped)[crop.slices])) < 4 * noise / np.sqrt(crop.width * crop.height)


def test_the_same_seed_gives_the_same_bits(room, pose, pebble) -> None:
    one, two = (room(pebble, light="front").take([pose(), pose(0.1)], samples=4, seed=7) for _ in range(2))
    other = room(pebble, light="front").take([pose(), pose(0.1)], samples=4, seed=9)
    np.testing.assert_array_equal(one.radiance, two.radiance)
    np.testing.assert_array_equal(one.coverage, two.coverage)
    assert not np.array_equal(one.coverage, other.coverage)


def test_the_corners_lose_what_vignetting_says(room, pebble) -> None:
    optics = room(pebble).optics
    picture = background_light(optics)
    bright = picture[39:41, 47:49].mean()
    assert bright == pytest.approx(1.0, abs=1e-3)
    panel = (1 - 0.2 * (47.5 / 6000 * 0.9 / optics.light.panel_half_m) ** 2) * (
        1 - 0.2 * (39.5 / 6000 * 0.9 / optics.light.panel_half_m) ** 2
    )
    assert picture[0, 0] == pytest.approx(0.9 * panel)
