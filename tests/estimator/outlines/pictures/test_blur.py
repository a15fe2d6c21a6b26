"""The blur has the covariance it says, and a smear is found in the picture."""

import numpy as np
import pytest

from datasets.vocabulary.outline import oriented
from estimator.geometry.coverage import coverage
from estimator.outlines import extract_outlines
from estimator.outlines.pictures.blur import blurred, bounded, fitted_blur, gaussian_kernel, isotropic, narrowest


@pytest.mark.parametrize("blur", [0.25, 0.5, 0.62, 0.65, 0.8, 1.5, 4.0])
def test_kernel_has_the_stated_variance(blur):
    kernel = gaussian_kernel(blur)
    taps = np.arange(len(kernel)) - len(kernel) // 2
    assert kernel.sum() == pytest.approx(1)
    assert float(kernel @ taps**2) == pytest.approx(blur**2, rel=0.02)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 1.2, np.pi / 2, 2.0])
@pytest.mark.parametrize("smear", [0.0, 0.2, 1.7])
def test_a_point_is_spread_with_the_stated_covariance(angle, smear):
    axis = np.array([np.cos(angle), np.sin(angle)])
    covariance = isotropic(0.9) + smear * np.outer(axis, axis)
    point = np.zeros((41, 41), np.float32)
    point[20, 20] = 1
    spread = blurred(point, covariance).astype(float)
    y, x = np.mgrid[-20:21, -20:21]
    found = np.array([[(spread * x * x).sum(), (spread * x * y).sum()], [(spread * x * y).sum(), (spread * y * y).sum()]])
    assert spread.sum() == pytest.approx(1, abs=1e-5)
    np.testing.assert_allclose(found, covariance, atol=0.01)


def test_the_image_of_a_polygon_agrees_with_supersampling(darkroom, rng):
    polygon = oriented(darkroom.stone(15, (30.3, 29.6), rng))
    difference = blurred(coverage(polygon, (60, 60)), isotropic(0.7)) - darkroom.draw(polygon, (60, 60), 0.7)
    assert np.abs(difference).max() < 0.05
    assert abs(difference.sum()) < 1.0


def test_a_covariance_is_found_from_its_variances_along_normals(rng):
    angle = rng.uniform(0, 2 * np.pi, 200)
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    covariance = np.array([[1.2, 0.4], [0.4, 0.6]])
    variances = np.einsum("ni,ij,nj->n", normals, covariance, normals)
    np.testing.assert_allclose(fitted_blur(variances, normals), covariance, atol=1e-9)


def test_bounds_keep_what_is_possible_and_mend_what_is_not():
    good = np.array([[1.2, 0.4], [0.4, 0.6]])
    np.testing.assert_allclose(bounded(good), good, atol=1e-12)
    assert np.linalg.eigvalsh(bounded(np.diag([-1.0, 0.2])))[0] > 0
    assert narrowest(bounded(np.diag([0.25, 4.0]))) == pytest.approx(0.5)


@pytest.mark.parametrize("length", [0.0, 1.0, 2.0])
def test_a_smear_neither_moves_the_outline_nor_counts_as_defocus(darkroom, rng, length):
    polygon, shape = darkroom.ellipse(30, 24, (60.2, 50.4)), (100, 120)
    along = (np.arange(16) + 0.5) / 16 * length - length / 2
    smeared = np.mean([darkroom.draw(polygon + a * np.array([0.6, 0.8]), shape, 0.6) for a in along], axis=0)
    picture = darkroom.expose(darkroom.panel(shape) * (1 - smeared), rng)
    seen = extract_outlines(darkroom.frames([picture], darkroom.expose(darkroom.panel(shape), rng))).frames[0]
    assert abs(darkroom.signed_distances(seen.outline.points_px, polygon).mean()) < 0.02
    assert abs(darkroom.support_difference(seen.outline.points_px, polygon)).max() < 0.12
    assert seen.edge_width_px == pytest.approx(2.563 * np.sqrt(0.36 + 1 / 12), rel=0.1)
