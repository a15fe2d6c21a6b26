"""A lens that is stated to be uncertain: what its errors do to pictures, and what the statement is made of."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.vocabulary.camera import HsvCamera, Intrinsics
from estimator.effects.instrument.uncertain_lens import UncertainLens, independent_errors, uncertain_lenses
from estimator.effects.model import Model

LENS = Intrinsics(1024, 800, 6000.0, 6010.0, 500.0, 410.0, (-0.2, 0.1, 1e-4, -2e-4, 0.0))
SIDE, FRONT = (HsvCamera(name, LENS, np.eye(3), np.zeros(3)) for name in ("side", "front"))
POINTS_CAM = np.array([[0.02, -0.01, 0.3], [-0.015, 0.012, 0.31], [0.0, 0.0, 0.3]])
SIGMA = np.array([6.0, 5.0, 2.0, 3.0, 0.02, 0.0, 1e-4, 1e-4, 0.0])


def covariance() -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Both focal lengths alike to a hundredth, two numbers exact."""
    alike = np.eye(9)
    alike[0, 1] = alike[1, 0] = 0.9999
    return alike * np.outer(SIGMA, SIGMA)


def test_what_the_true_lens_shows_is_brought_to_where_the_stated_one_would_show_it() -> None:
    (effect,) = uncertain_lenses([replace(SIDE, lens_covariance=covariance())])
    theta = np.array([0.5, -1.0, 2.0, 0.3, -0.7, 1.1, 0.2])
    true = LENS.with_numbers(LENS.numbers + theta @ effect.errors)
    seen = true.project(POINTS_CAM)
    assert np.abs(seen - LENS.project(POINTS_CAM)).max() > 1.0
    np.testing.assert_allclose(effect.correct(theta, seen, LENS, np.zeros(3)), LENS.project(POINTS_CAM), atol=1e-6)


def test_a_lens_that_is_as_stated_moves_nothing_and_other_cameras_keep_their_pictures() -> None:
    (effect,) = uncertain_lenses([replace(SIDE, lens_covariance=covariance())])
    model, seen, much = Model((effect,)), LENS.project(POINTS_CAM), np.full(7, 2.0)
    np.testing.assert_allclose(model.correct(np.zeros(7), seen, SIDE, np.zeros(3)), seen, atol=1e-9)
    np.testing.assert_array_equal(model.correct(much, seen, FRONT, np.zeros(3)), seen)
    assert not np.allclose(model.correct(much, seen, SIDE, np.zeros(3)), seen)


def test_errors_are_as_many_as_the_covariance_has_and_make_it_up() -> None:
    errors = np.array(list(independent_errors(covariance())))
    assert errors.shape == (7, 9)
    np.testing.assert_allclose(errors.T @ errors, covariance(), rtol=1e-9, atol=1e-12)
    one = np.array([1.0, 2.0, 0.0])
    (only,) = independent_errors(np.outer(one, one))
    np.testing.assert_allclose(np.abs(only), one, atol=1e-12)


def test_only_cameras_of_which_something_is_stated_have_one_and_the_widest_counts() -> None:
    exact, wide = replace(FRONT, lens_covariance=np.zeros((9, 9))), replace(SIDE, lens_covariance=4.0 * covariance())
    found = uncertain_lenses([SIDE, replace(SIDE, lens_covariance=covariance()), wide, exact, FRONT])
    assert [effect.entry.key for effect in found] == ["uncertain_lens@side"]
    np.testing.assert_allclose(found[0].errors.T @ found[0].errors, 4.0 * covariance(), rtol=1e-9, atol=1e-12)
    assert found[0].instrument
    assert Model((found[0],)).precision == pytest.approx(np.ones(7))
    assert isinstance(found[0], UncertainLens)
