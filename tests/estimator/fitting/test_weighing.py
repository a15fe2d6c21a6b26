"""Weighed errors against the dense matrices of each sighting, one after the other."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from estimator.appearance.model_errors import ModelErrors, SequenceTask, model_errors
from estimator.geometry.silhouettes import UNSURE_PX
from estimator.likelihood.composite_likelihood import RandomShift, Sighting, WeighedFrames, design_effects, sighting, weigh_linear
from estimator.likelihood.noise_model import angle_correlation
from estimator.likelihood.time_shifts import time_derivative
from tests.estimator.small_campaign import fitted, registered

FLOOR_PX, HUBER = 0.03, 1.5  # so small that some errors lie beyond
Array = np.ndarray


def sequence() -> SequenceTask:
    found: SequenceTask = registered().campaign.sequences[0]
    return found


def errors() -> ModelErrors:
    fit = fitted()
    return model_errors(sequence(), fit.state.flights[0], fit.model, fit.state.theta[0])


def weighed(at: ModelErrors, shift: RandomShift | None = None, huber: float = HUBER) -> WeighedFrames:
    first = sequence().task.sightings.silhouettes
    return weigh_linear((at.e, at.J), at.tangency, first, floor_px=FLOOR_PX, huber=huber, shift=shift)


def one_by_one(at: ModelErrors, huber: float) -> Iterator[tuple[int, Sighting, Array]]:
    """Sightings and the variances of their errors divided by what their own noise repeats."""
    for i in at.tangency.telling:
        first = sequence().task.sightings.silhouettes
        seen = sighting((at.e, at.J), at.tangency, first, i, floor_px=FLOOR_PX, huber=huber)
        z1 = 1.0 / np.sqrt(np.diag(seen.Sigma))
        yield int(i), seen, np.diag(seen.Sigma) * (z1 @ seen.Sigma @ z1) / len(z1)


def test_every_error_counts_by_its_variance_and_how_often_its_noise_repeats() -> None:
    at = errors()
    H, g, meat, chi2 = 0.0, 0.0, 0.0, np.zeros(len(at.e))
    far = 0
    for i, seen, repeated in one_by_one(at, HUBER):
        W = seen.J / repeated[:, None]
        H, g, meat = H + W.T @ seen.J, g + W.T @ seen.e, meat + W.T @ seen.Sigma @ W
        chi2[i] = np.sum(seen.e**2 / np.diag(seen.Sigma))
        far += np.count_nonzero(seen.e**2 > HUBER**2 * np.diag(seen.Sigma))
    found = weighed(at)
    assert far > 10
    for value, expected in ((found.H, H), (found.g, g), (found.meat, meat), (found.chi2, chi2)):
        np.testing.assert_allclose(value, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
    assert found.count.sum() == at.tangency.told[:, :, :2].sum()


@pytest.mark.parametrize("huber", [1e6, HUBER])
def test_a_random_effect_is_variance_along_what_it_moves(huber: float) -> None:
    at, sigma = errors(), 3e-6
    direction = time_derivative(at)
    H, g, meat, far = 0.0, 0.0, 0.0, 0
    for i, seen, repeated in one_by_one(at, np.inf):
        moved = sigma * direction[i, seen.view, seen.side]
        left = seen.e - moved * (moved @ np.linalg.solve(np.diag(repeated) + np.outer(moved, moved), seen.e))
        variance = np.diag(seen.Sigma)
        outlying = np.maximum(np.abs(left) / np.sqrt(variance) / huber, 1.0)
        far += np.count_nonzero(outlying > 1.0)
        Sigma = seen.Sigma + np.diag(variance * (outlying - 1.0)) + np.outer(moved, moved)
        W = np.linalg.solve(np.diag(repeated * outlying) + np.outer(moved, moved), seen.J)
        H, g, meat = H + W.T @ seen.J, g + W.T @ seen.e, meat + W.T @ Sigma @ W
    found = weighed(at, RandomShift(direction, sigma), huber=huber)
    assert (far > 10) == (huber == HUBER)
    for value, expected in ((found.H, H), (found.g, g), (found.meat, meat)):
        np.testing.assert_allclose(value, expected, rtol=1e-8, atol=1e-11 * np.abs(expected).max())
    still = weighed(at, RandomShift(direction, 0.0))
    np.testing.assert_array_equal(still.H, weighed(at).H)


def test_what_is_no_number_and_not_told_weighs_nothing() -> None:
    at = errors()
    told = at.tangency.told[:, :, :2]
    tangency = replace(at.tangency, variance=np.where(np.arange(len(told))[:, None, None] == 3, UNSURE_PX**2, at.tangency.variance))
    known = weighed(replace(at, tangency=tangency))
    assert known.count[3] == 0
    e, J = at.e.copy(), at.J.copy()
    e[3], J[3] = np.nan, np.nan
    np.testing.assert_array_equal(weighed(replace(at, e=e, J=J, tangency=tangency)).H, known.H)
    np.testing.assert_array_equal(weighed(replace(at, e=e, J=J, tangency=tangency)).g, known.g)


def test_what_a_random_effect_explains_is_no_outlier() -> None:
    """Errors of a late frame are as a late frame's: none of them is far off once the shift is taken off."""
    at, sigma = errors(), 1e-4
    direction = time_derivative(at)
    late = np.where(at.seen, direction * sigma, 0.0)
    first = sequence().task.sightings.silhouettes
    known = weigh_linear((late, at.J), at.tangency, first, floor_px=FLOOR_PX, huber=4.0, shift=RandomShift(direction, sigma))
    plain = weigh_linear((late, at.J), at.tangency, first, floor_px=FLOOR_PX, huber=4.0)
    assert plain.chi2.sum() < 0.5 * known.chi2.sum()


@pytest.mark.parametrize("wrapped", [False, True])
def test_the_design_effect_is_the_mean_sum_of_correlations(wrapped: bool) -> None:
    rng = np.random.default_rng(8)
    angle = rng.uniform(2.0, 4.2, (1, 9, 2)) if wrapped else rng.uniform(-1.0, 1.0, (1, 9, 2))
    angle = np.arctan2(np.sin(angle), np.cos(angle))
    share, told = rng.uniform(0.2, 1.0, (1, 9, 2)), rng.random((1, 9, 2)) > 0.3
    R = angle_correlation(angle[told], 0.4) * np.outer(share[told], share[told])
    np.fill_diagonal(R, 1.0)
    np.testing.assert_allclose(design_effects(share, angle, told, np.array([0.4])), R.sum() / told.sum(), rtol=1e-12)
    assert design_effects(share, angle, np.zeros_like(told), np.array([0.4])) == 1.0
