"""Amplitudes of the surface have the size that they most probably have; in other units they are the same surface."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import fit_campaign
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.measurements.outlines import surface_scale
from estimator.measurements.outlines.surface_scale import with_surface_scale
from estimator.measurements.outlines.task import amplitudes_in
from estimator.motion.flight import OMEGA
from tests.estimator.measurements.outlines.sampled_campaign import fitted, registered


def test_other_units_of_amplitudes_change_no_residual(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, fit = registered().campaign, fitted()
    monkeypatch.setattr(surface_scale, "scale_of", lambda _information, _pull: 3.0)
    scaled, state = with_surface_scale(campaign, fit)
    part = amplitudes_in(fit.model)
    for i, theta in enumerate(state.theta):
        np.testing.assert_allclose(3.0 * theta[part], fit.state.theta[i][part])
        before = campaign.kind.residuals(campaign, i, fit.state.flights[i], fit.model, fit.state.theta[i])
        after = campaign.kind.residuals(scaled, i, state.flights[i], fit.model, theta)
        np.testing.assert_allclose(after.e, before.e, atol=1e-9)


def test_a_surface_that_is_less_sure_says_less_of_spins(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, fit = registered().campaign, fitted()
    spread = []
    for scale in (1.0, 4.0):
        monkeypatch.setattr(surface_scale, "scale_of", lambda _information, _pull, scale=scale: scale)
        scaled, state = with_surface_scale(campaign, fit)
        again = fit_campaign(scaled, state, fit.model)
        spread.append(np.diag(campaign_covariance(scaled, again).of(0, np.arange(*OMEGA.indices(21)))))
    assert np.all(spread[1] > spread[0])


def test_the_scale_is_that_of_the_amplitudes() -> None:
    campaign, fit = registered().campaign, fitted()
    part = amplitudes_in(fit.model)
    found = []
    for size in (1.0, 40.0):
        theta = tuple(np.concatenate([size * each[part], each[part.stop :]]) for each in fit.state.theta)
        state = replace(fit.state, theta=theta)
        scaled, _ = with_surface_scale(campaign, replace(fit, state=state))
        found.append(
            scaled.sequences[0].amplitudes.moves
            / np.where(campaign.sequences[0].amplitudes.moves == 0.0, 1.0, campaign.sequences[0].amplitudes.moves)
        )
    assert np.abs(found[1]).max() > 3.0 * np.abs(found[0]).max()


@pytest.mark.parametrize("key", ["trigger_jitter", "dropped_frames"])
def test_surfaces_follow_models_with_parameters_that_no_step_changes(key: str) -> None:
    campaign, fit = registered().campaign, fitted()
    model = Model((*fit.model.effects, MODELS[key]))
    theta = tuple(np.concatenate([each, np.zeros(model.size - len(each))]) for each in fit.state.theta)
    fit = fit_campaign(campaign, replace(fit.state, theta=theta), model)
    made, state = campaign.kind.relinearised(campaign, fit)
    assert made is not campaign
    assert all(np.isfinite(each).all() for each in state.theta)
