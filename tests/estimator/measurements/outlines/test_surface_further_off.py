"""What a campaign's surface adds to uncertainties is told with the factor by which surfaces are further off than they say."""

import numpy as np

from estimator.effects.choosing import catalogue
from estimator.effects.instrument.surface_amplitudes import FURTHER_OFF
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.considered import uncertain
from estimator.measurements.outlines.task import amplitudes_in
from estimator.motion.flight import LAYOUT, N_PARAMETERS
from tests.estimator.measurements.outlines.sampled_campaign import registered


def test_uncertainties_were_the_surface_known_are_left_and_the_rest_counts_more() -> None:
    campaign = registered().campaign
    fit = base_fit(campaign, registered().start)
    plain, told = campaign_covariance(campaign, fit), uncertain(campaign, fit, catalogue(campaign.cameras)).at.fitted
    motion, part = LAYOUT.columns(["v", "omega"]), amplitudes_in(fit.model)
    both = np.concatenate([motion, N_PARAMETERS + np.arange(part.start, part.stop)])
    for number in range(len(campaign.sequences)):
        covariance = plain.of(number, motion)
        information = np.linalg.inv(plain.of(number, both))
        bound = np.linalg.inv(information[: len(motion), : len(motion)])  # were the surface known
        expected = bound + FURTHER_OFF**2 * (covariance - bound)
        np.testing.assert_allclose(told.of(number, motion), expected, rtol=1e-5, atol=1e-9 * np.abs(expected).max())
        assert np.all(np.diag(expected) > np.diag(covariance))
