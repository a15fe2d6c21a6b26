"""Coverage is exact."""

import numpy as np
import pytest
import shapely

from datasets.vocabulary.outline import oriented
from estimator.geometry.coverage import coverage


def test_coverage_is_the_exact_area_of_each_pixel():
    polygon = oriented(np.array([[10.2, 10.0], [22.7, 12.0], [30.5, 25.4], [20.0, 20.0], [12.0, 27.9]]))
    seen = coverage(polygon, (34, 36))
    region = shapely.Polygon(polygon)
    for i, j in np.random.default_rng(5).integers(0, 34, (200, 2)):
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
