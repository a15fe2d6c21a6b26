"""The outline's bias and spread against a known polygon."""

import numpy as np
import pytest

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
