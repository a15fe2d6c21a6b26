"""What pictures do to outlines is what picturing the known outline again says, against pictures that are drawn independently."""

import numpy as np
import pytest

from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.tangent_hull import tangent_hull
from estimator.outlines import extract_outlines
from estimator.outlines.pictures.contour import PIXEL_VARIANCE
from estimator.outlines.pictures.pictured import Pictures, mean_seen, pictured_supports

SHAPE = (96, 112)
PICTURES = 24
OUTWARD = unit_circle(180)


def star(centre):
    """A body with sharp tips, as far out as hollows are deep."""
    angle = np.linspace(0.0, 2.0 * np.pi, 14, endpoint=False)
    return np.where(np.arange(14) % 2, 14.0, 26.0)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]) + centre


def bias(found, polygon):
    """Supports beyond those of the polygon, without what moves it as a whole."""
    beyond = found - (polygon @ OUTWARD.T).max(axis=0)
    return beyond - OUTWARD @ np.linalg.lstsq(OUTWARD, beyond, rcond=None)[0]


@pytest.mark.parametrize("blur_px", [0.2, 0.6, 1.2])
def test_outlines_are_seen_as_they_are_pictured(darkroom, blur_px):
    """Tips that deblurring and smoothing leave short by a pixel, to a few hundredths of one."""
    rng = np.random.default_rng(4)
    places = [np.array([55.0, 47.0]) + rng.uniform(0.0, 1.0, 2) for _ in range(PICTURES)]
    polygons = [star(place) for place in places]
    frames = darkroom.frames(
        [darkroom.back_lit(p, SHAPE, rng, blur_px=blur_px) for p in polygons], darkroom.expose(darkroom.panel(SHAPE), rng)
    )
    track = extract_outlines(frames)
    assert track.used.all()
    hulls = [tangent_hull(o.points_px).points_px for o in track.outlines]
    seen = np.mean([bias((h @ OUTWARD.T).max(axis=0), p) for h, p in zip(hulls, polygons, strict=True)], axis=0)
    pictures = Pictures.of(track.frames)
    assert np.median(pictures.blur_px) == pytest.approx(blur_px, abs=0.1)
    predicted = pictured_supports(polygons, pictures, OUTWARD, draws=2, rng=np.random.default_rng(0))
    predicted = np.mean([bias(s, p) for s, p in zip(predicted, polygons, strict=True)], axis=0)
    assert np.sqrt(np.mean(seen**2)) > 0.7
    assert np.sqrt(np.mean((predicted - seen) ** 2)) < 0.04 * np.sqrt(np.mean(seen**2))


def test_the_mean_of_what_is_seen_has_its_mean_support():
    pictures = Pictures(np.array([0.5]), np.array([0.01]))
    polygon = star(np.zeros(2))
    hull = mean_seen(polygon, OUTWARD, pictures, draws=6, rng=np.random.default_rng(1))
    (support,) = pictured_supports([polygon], pictures, OUTWARD, draws=6, rng=np.random.default_rng(1))
    np.testing.assert_allclose((hull @ OUTWARD.T).max(axis=0), support, atol=0.01)


def test_what_cannot_be_seen_is_as_it_is():
    """Nothing at all, and what is smaller than its blur."""
    pictures = Pictures(np.array([0.5, 8.0]), np.array([0.01, 0.01]))
    small = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    nothing, as_it_is = pictured_supports([np.zeros((0, 2)), small], pictures, OUTWARD, draws=2, rng=np.random.default_rng(2))
    assert not nothing.any()
    np.testing.assert_allclose(as_it_is, (small @ OUTWARD.T).max(axis=0))


def test_edges_follow_the_focus_and_not_single_pictures_and_cameras_are_told_apart():
    near, far = np.linspace(0.2, 0.8, 40), np.full(40, 2.0)
    blur = np.concatenate([near, far])
    camera = np.repeat([0, 1], 40)
    spoilt = blur.copy()
    spoilt[20] = 5.0
    found = Pictures(spoilt, np.zeros(80)).edge_px(camera)
    np.testing.assert_allclose(found, np.sqrt(blur**2 + PIXEL_VARIANCE), atol=0.035)
    np.testing.assert_array_equal(found[40:], np.sqrt(4.0 + PIXEL_VARIANCE))
