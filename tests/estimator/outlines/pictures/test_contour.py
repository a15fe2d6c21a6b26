"""The outline's bias and spread against a known polygon."""

import numpy as np
import pytest
from scipy.signal import fftconvolve

from datasets.vocabulary.outline import signed_area
from estimator.geometry.coverage import coverage
from estimator.outlines import OutlineSettings, extract_outlines
from estimator.outlines.pictures.blur import blurred, isotropic
from estimator.outlines.pictures.contour import half_level_contour, outward_normals, refined, roughness


def measured(darkroom, polygon, rng, *, blur_px, settings=None, own=0.02):
    shape = (140, 160)
    taken = np.mean([darkroom.expose(darkroom.panel(shape), rng) for _ in range(8)], axis=0).round().astype(np.uint16)
    frames = darkroom.frames([darkroom.back_lit(polygon, shape, rng, blur_px=blur_px, own=own)], taken)
    return extract_outlines(frames, settings=settings).frames[0]


@pytest.mark.parametrize("blur_px", [0.3, 0.5, 0.8, 1.5])
@pytest.mark.parametrize("radius", [20, 40])
def test_a_smooth_outline_is_unbiased(darkroom, rng, blur_px, radius):
    polygon = darkroom.ellipse(radius, 0.75 * radius, (80 + rng.random(), 70 + rng.random()))
    seen = measured(darkroom, polygon, rng, blur_px=blur_px)
    distance = darkroom.signed_distances(seen.outline.points_px, polygon)
    assert seen.used
    assert abs(distance.mean()) < 0.02
    assert distance.std() < 0.035


def test_stones_are_unbiased_and_the_refinement_is_what_does_it(darkroom, rng):
    before, after, support_before, support_after = [], [], [], []
    for _ in range(6):
        polygon = darkroom.stone(28, (80 + rng.random(), 70 + rng.random()), rng)
        for distances, supports, rounds in ((before, support_before, 0), (after, support_after, 2)):
            seen = measured(darkroom, polygon, rng, blur_px=0.7, settings=OutlineSettings(refinements=rounds))
            distances.append(darkroom.signed_distances(seen.outline.points_px, polygon))
            supports.append(darkroom.support_difference(seen.outline.points_px, polygon))
    bias = np.concatenate(after).mean()
    assert abs(bias) < 0.01 < abs(np.concatenate(before).mean())
    assert np.concatenate(after).std() < 0.035
    assert -0.06 < np.concatenate(support_after).mean() < 0.5 * np.concatenate(support_before).mean() + 0.05
    assert np.sqrt(np.mean(np.concatenate(support_after) ** 2)) < 0.6 * np.sqrt(np.mean(np.concatenate(support_before) ** 2))


@pytest.mark.parametrize("blur_px", [0.5, 1.0, 2.0])
def test_the_edge_width_is_measured(darkroom, rng, blur_px):
    seen = measured(darkroom, darkroom.ellipse(35, 30, (80.2, 70.6)), rng, blur_px=blur_px)
    assert seen.edge_width_px == pytest.approx(2.563 * np.sqrt(blur_px**2 + 1 / 12), rel=0.08)


def test_noise_and_contrast_are_those_of_the_sensor(darkroom, rng):
    seen = measured(darkroom, darkroom.ellipse(35, 30, (80.2, 70.6)), rng, blur_px=0.6)
    electrons = 16000 * 0.98
    assert seen.contrast == pytest.approx(electrons / 20000 * 0.97, rel=0.03)
    assert seen.noise == pytest.approx(np.sqrt(16000) / electrons * np.sqrt(1 + 1 / 8), rel=0.15)
    assert seen.misfit < 1.5 * seen.noise


def test_the_stated_sigma_is_the_spread_of_one_point(darkroom, rng):
    polygon = darkroom.ellipse(35, 30, (80.2, 70.6))
    runs = [measured(darkroom, polygon, rng, blur_px=0.7) for _ in range(8)]
    spread = np.sqrt(np.mean([darkroom.signed_distances(r.outline.points_px, polygon).var() for r in runs]))
    stated = np.mean([r.sigma_px for r in runs])
    assert 0.7 < spread / stated < 1.4


def test_roughness_is_the_standard_deviation_of_white_noise(darkroom, rng):
    ring = darkroom.ellipse(60, 50, (0.0, 0.0), points=350)
    assert roughness(ring) < 1e-3
    noisy = ring + 0.2 * rng.standard_normal(350)[:, None] * outward_normals(ring)
    assert roughness(noisy) == pytest.approx(0.2, rel=0.2)


def test_a_particle_that_is_not_black_has_the_same_outline(darkroom, rng):
    polygon = darkroom.stone(28, (80.4, 70.1), rng)
    seen = measured(darkroom, polygon, rng, blur_px=0.7, own=0.3)
    assert abs(darkroom.signed_distances(seen.outline.points_px, polygon).mean()) < 0.02


def test_outlines_are_closed_rings_of_positive_area(darkroom, rng):
    polygon = darkroom.ellipse(30, 20, (80.0, 70.0))
    points = measured(darkroom, polygon, rng, blur_px=0.6).outline.points_px
    assert signed_area(points) == pytest.approx(np.pi * 600, rel=0.005)
    gaps = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
    assert 0.6 < gaps.min() <= gaps.max() < 1.5


def test_bright_patches_inside_are_filled(darkroom, rng):
    shape = (140, 160)
    outer, hole = darkroom.ellipse(35, 30, (80.0, 70.0)), darkroom.ellipse(12, 9, (84.0, 66.0))
    light = darkroom.panel(shape) * (1 - darkroom.draw(outer, shape, 0.6) + 0.9 * darkroom.draw(hole, shape, 0.6))
    frames = darkroom.frames([darkroom.expose(light, rng)], darkroom.expose(darkroom.panel(shape), rng))
    seen = extract_outlines(frames).frames[0]
    distance = darkroom.signed_distances(seen.outline.points_px, outer)
    assert abs(distance.mean()) < 0.02
    assert np.abs(distance).max() < 0.15


@pytest.mark.parametrize("radius", [8.0, 15.0, 30.0])
def test_chords_between_points_do_not_move_a_curved_edge(radius):
    turned = 2.0 * np.pi * np.arange(4000) / 4000
    centre = np.array([40.3, 41.6])
    image = blurred(coverage(centre + radius * np.column_stack([np.cos(turned), np.sin(turned)]), (82, 82)), isotropic(0.5))
    edge = refined(half_level_contour(image), image, blur_px=0.5, spacing_px=1.0, rounds=3)
    off = np.linalg.norm(edge.points_px - centre, axis=1) - radius
    assert abs(off.mean()) < 0.2 / (12.0 * radius)


@pytest.mark.parametrize(("level", "most_px"), [(0.2, 0.12), (0.4, 0.35)])
def test_light_that_leaks_at_a_facet_draws_the_edge_inwards_by_little(darkroom, rng, level, most_px):
    """A band of two pixels inside of one side is lighter than the rest; by one level for all that side lay 0.29 and 0.74 px in."""
    shape, corners = (140, 160), np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    body, band = (
        darkroom.draw(corners * size + at, shape, 0.5) for size, at in (((40.0, 40.0), (60.0, 50.0)), ((36.0, 2.0), (62.0, 50.0)))
    )
    light = darkroom.panel(shape) * (1.0 - 0.98 * body + level * band)
    taken = np.mean([darkroom.expose(darkroom.panel(shape), rng) for _ in range(8)], axis=0).round().astype(np.uint16)
    points = extract_outlines(darkroom.frames([darkroom.expose(light, rng)], taken)).frames[0].outline.points_px
    along = (points[:, 0] > 66.0) & (points[:, 0] < 94.0)
    lit, dark = points[along & (points[:, 1] < 60.0), 1] - 50.0, 90.0 - points[along & (points[:, 1] > 80.0), 1]
    assert abs(dark.mean()) < 0.02, "the other sides stay where they are"
    assert -0.02 < lit.mean() < most_px


@pytest.mark.parametrize("radius", [2.0, 3.0, 4.0])
def test_a_blur_that_is_no_gaussian_is_no_leak(radius):
    """Out of focus a disc blurs an edge, alike all round: levels that are free alike drew it in by 0.006, 0.026 and 0.054 px."""
    fine = coverage(np.array([[120.0, 100.0], [680.0, 100.0], [680.0, 700.0], [120.0, 700.0]]) + 1.7, (800, 800))
    y, x = np.mgrid[-40:41, -40:41]
    disc = (np.hypot(x, y) <= 10.0 * radius).astype(float)
    image = fftconvolve(fine, disc / disc.sum(), mode="same").reshape(80, 10, 80, 10).mean(axis=(1, 3)).astype(np.float32)
    edge = refined(half_level_contour(image), image, blur_px=0.5 * radius, spacing_px=1.0, rounds=2)
    x, y = ((edge.points_px + 0.5) * 10.0 - 0.5).T
    flat = (y > 250.0) & (y < 550.0)
    assert abs(np.mean(np.concatenate([x[flat & (x > 400.0)] - 681.7, 121.7 - x[flat & (x < 400.0)]]))) < 0.004
