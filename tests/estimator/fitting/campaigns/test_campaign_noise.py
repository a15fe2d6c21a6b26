"""Noise that enters several sequences, by weights that are as wide as a sequence's own parameters."""

import numpy as np

from estimator.fitting.campaigns.campaign_noise import repeated_noise
from estimator.fitting.system import Arrangement
from tests.estimator.small_campaign import fitted, registered


def test_weights_of_each_sequence_give_what_weights_as_wide_as_all_parameters_give() -> None:
    campaign, fit = registered().campaign, fitted()
    at, errors = fit.layout, [each.errors for each in fit.equations]
    own = [each.frames for each in fit.equations]
    wide = [each.combined(np.eye(at.p)[place]) for each, place in zip(own, at.places, strict=True)]
    found = repeated_noise(campaign, errors, own, at)
    expected = repeated_noise(campaign, errors, wide, Arrangement((np.arange(at.p),) * len(own), at.p))
    scale = np.sqrt(np.maximum(np.diag(expected), 1e-300))
    np.testing.assert_allclose(found / scale / scale[:, None], expected / scale / scale[:, None], atol=1e-10)
    assert np.abs((found / scale / scale[:, None])[:12, 12:24]).max() > 0.1
