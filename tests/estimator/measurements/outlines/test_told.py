"""What is told of outlines sample by sample: no amplitudes of the surface, mass properties with it, and no tangency errors."""

import re
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from datasets.estimate import Status
from datasets.json_documents import plain
from estimator.data.configuration import Configuration
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.considered import considered
from estimator.motion.flight import COM, INERTIA, NAMES
from estimator.reports.campaign_reporting import campaign_estimates
from estimator.reports.told_parameters import told_parameters
from tests.estimator.measurements.outlines.sampled_campaign import fitted, registered
from tests.estimator.small_campaign import observations
from tumble.campaigning import Prepared
from tumble.diagnosing import Question, compared
from tumble.diagnosis_documents import campaign_content
from tumble.reports.campaign_page import render
from tumble.reports.words import rms_ete_px


def test_estimates_have_no_amplitudes() -> None:
    campaign, fit = registered().campaign, fitted()
    at = considered(campaign, fit, campaign_covariance(campaign, fit), ())
    made = {each.name: each for each in observations()}
    for number, estimate in enumerate(campaign_estimates(registered(), made, fit, at, Configuration(campaign_surface_fit=2))):
        assert estimate.parameters == NAMES
        assert estimate.values.shape == (len(NAMES),)
        assert estimate.covariance.shape == (len(NAMES), len(NAMES))
        theta, flight = fit.state.theta[number], fit.state.flights[number]
        body = fit.model.body(theta, campaign.sequences[number].setting)
        np.testing.assert_allclose(estimate.values[COM], flight.com + body.com, atol=1e-15)
        np.testing.assert_allclose(estimate.values[INERTIA], flight.inertia + body.inertia, atol=1e-12)
        assert 0.1 < estimate.statistics["rms_px"] < 0.3
        assert rms_ete_px(estimate) is None


def test_a_flight_whose_residuals_are_many_times_the_outlines_noise_is_no_measurement() -> None:
    """A fit takes them for noise, so that they are as large as that; a recording stretched by 15 % was called converged."""
    found, fit = registered(), fitted()
    first, *others = found.campaign.sequences
    campaign = replace(found.campaign, sequences=(replace(first, noise=8.0), *others))
    at = considered(campaign, fit, campaign_covariance(campaign, fit), ())
    made = {each.name: each for each in observations()}
    estimates = campaign_estimates(replace(found, campaign=campaign), made, fit, at, Configuration(campaign_surface_fit=2))
    assert [each.status for each in estimates] == [Status.NO_CONVERGENCE, Status.CONVERGED]
    assert re.search(r"the fit misses what was measured by [78]\.\d times its noise", estimates[0].message)


def test_the_covariance_of_mass_properties_is_that_with_the_surface() -> None:
    campaign, fit = registered().campaign, fitted()
    covariance = campaign_covariance(campaign, fit)
    told = told_parameters(campaign, fit, covariance)
    mass = campaign.sequences[0].setting.mass
    B = np.hstack([np.eye(8), mass[:, 1:]])
    columns = np.r_[COM, INERTIA, np.arange(len(NAMES), len(NAMES) + fit.model.size)]
    expected = B @ covariance.of(0, columns) @ B.T
    own = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(told.covariance.of(0, np.r_[COM, INERTIA]) / np.outer(own, own), expected / np.outer(own, own), atol=1e-9)
    np.testing.assert_allclose(told.covariance.of(1, np.arange(12)), covariance.of(1, np.arange(12)))


def test_the_campaign_s_document_has_none_either() -> None:
    campaign, fit = registered().campaign, fitted()
    content = campaign_content(campaign, fit, campaign_covariance(campaign, fit), ())
    assert content["parameters"] == []
    assert content["effects"] == []
    assert content["unit"] == "σ"
    assert {len(each["rows"]) for each in content["sequences"]} == {len(NAMES)}
    assert max(row for each in content["sequences"] for row in each["rows"]) == len(content["covariance"]) - 1


def test_the_page_says_nothing_of_tangents() -> None:
    """Residuals are in standard deviations of the noise, their maps in pixels."""
    question = Question(Path("made"), asdict(Configuration(campaign_surface_fit=2)), (), "")
    found = Prepared(registered(), {each.name: each for each in observations()}, {})
    document = plain(compared(question, found, lambda _: None))
    page = render(document)
    assert not re.search("ETE|tangenc|view's", page)
    assert "RMS residual" in page
    assert "px in the high-speed picture" in page
    assert {each["residual_unit"] for each in document["maps"]} == {"px"}
