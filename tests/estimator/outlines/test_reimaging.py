"""Coverage is exact; the blur has the variance it says."""

import numpy as np
import pytest
import shapely

from datasets.vocabulary.outline import oriented
from estimator.outlines.reimaging import coverage, gaussian_kernel, reimage


def test_coverage_is_the_exact_area_of_each_pixel(rng):
    polygon = oriented(np.array([[10.2, 10.0], [22.7, 12.0], [30.5, 25.4], [20.0, 20.0], [12.0, 27.9]]))
    seen = coverage(polygon, (34, 36))
    region = shapely.Polygon(polygon)
    for i, j in rng.integers(0, 34, (200, 2)):
        pixel = shapely.box(j - 0.5, i - 0.5, j + 0.5, i + 0.5)
        assert seen[i, j] == pytest.approx(region.intersection(pixel).area, abs=1e-6)


def test_coverage_of_edges_on_pixel_borders():
    seen = coverage(np.array([[1.5, 1.5], [4.5, 1.5], [4.5, 3.5], [1.5, 3.5]]), (6, 7))
    expected = np.zeros((6, 7))
    expected[2:4, 2:5] = 1
    np.testing.assert_allclose(seen, expected, atol=1e-7)


def test_an_outline_beyond_the_picture_covers_what_is_left_of_it():
    seen = coverage(np.array([[-5.0, -5.0], [3.0, -5.0], [3.0, 20.0], [-5.0, 20.0]]), (8, 8))
    np.testing.assert_allclose(seen.sum(axis=1), np.full(8, 3.5), atol=1e-6)


@pytest.mark.parametrize("blur", [0.25, 0.5, 0.62, 0.65, 0.8, 1.5, 4.0])
def test_kernel_has_the_stated_variance(blur):
    kernel = gaussian_kernel(blur)
    taps = np.arange(len(kernel)) - len(kernel) // 2
    assert kernel.sum() == pytest.approx(1)
    assert float(kernel @ taps**2) == pytest.approx(blur**2, rel=0.02)


def test_reimaging_agrees_with_supersampling(darkroom, rng):
    polygon = oriented(darkroom.stone(15, (30.3, 29.6), rng))
    difference = reimage(polygon, (60, 60), 0.7) - darkroom.draw(polygon, (60, 60), 0.7)
    assert np.abs(difference).max() < 0.05
    assert abs(difference.sum()) < 1.0
