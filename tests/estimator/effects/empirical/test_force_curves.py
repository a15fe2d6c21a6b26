"""Curves of force and torque under their prior, and the terms of laws as effects."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.appearance.effect_contracts import check_contracts
from estimator.effects.empirical.force_curves import DEGREES, LARGEST_MS2, ForceCurve, TorqueCurve, basis
from estimator.effects.empirical.law_effect import law_effect
from estimator.effects.empirical.law_terms import TERMS, Term
from estimator.effects.link import Moment, Setting
from estimator.effects.model import Model
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign, sequence_equations
from estimator.motion.flight import N_PARAMETERS
from tests.estimator.small_campaign import fitted, registered

SETTING = Setting(0.01 + np.arange(81) / 4000.0, 5e-5, np.zeros(3), np.ones(3))


def moment(theta_rows: int, time_s: float = 0.004) -> Moment:
    rng = np.random.default_rng(2)
    R = np.linalg.qr(rng.normal(size=(theta_rows, 3, 3)))[0]
    vectors = (rng.uniform(0.3, 1.0, (theta_rows, 3)) for _ in range(4))
    return Moment(time_s, *vectors, R)


def test_polynomials_follow_a_thrust_through_one_and_a_half_turns() -> None:
    """Ten of them leave less than 2% of a vector that turns by 3 pi."""
    times = np.linspace(0.0, 0.02, 200)
    turning = np.cos(3.0 * np.pi * times / 0.02 + 0.4)
    A = basis(times, SETTING)
    left = turning - A @ np.linalg.lstsq(A, turning, rcond=None)[0]
    assert np.abs(left).max() < 0.02


def test_a_curve_is_its_polynomials() -> None:
    theta = np.random.default_rng(0).normal(size=(4, 3 * len(DEGREES)))
    there = ForceCurve().acceleration(theta, moment(4), SETTING)
    assert there is not None
    np.testing.assert_allclose(there, np.einsum("mdx,d->mx", theta.reshape(4, -1, 3), basis(np.array([0.004]), SETTING)[0]))


def test_the_prior_keeps_a_curve_without_evidence_small_and_is_counted_once() -> None:
    found, fit = registered(), fitted()
    model = Model((*fit.model.effects, ForceCurve()))
    rng = np.random.default_rng(1)
    theta = tuple(np.concatenate([t, rng.normal(size=3 * len(DEGREES))]) for t in fit.state.theta)
    state = CampaignState(fit.state.flights, theta)
    held = sequence_equations(found.campaign, 0, state, model).frames
    free = sequence_equations(found.campaign, 0, state, Model((*fit.model.effects, _free()))).frames
    part = N_PARAMETERS + np.arange(model.slices[-1].start, model.size)
    sigma = np.repeat(LARGEST_MS2 / (1.0 + np.array(DEGREES)), 3)
    np.testing.assert_allclose(np.diag(held.H - free.H)[part], sigma**-2.0, rtol=1e-6)
    np.testing.assert_allclose((held.g - free.g)[part], theta[0][model.slices[-1]] / sigma**2, rtol=1e-6)
    np.testing.assert_allclose(np.diag(held.meat - free.meat)[part], sigma**-2.0, rtol=1e-6)


def _free() -> ForceCurve:
    return type("Free", (ForceCurve,), {"held": None})()


def test_curves_stay_small_where_nothing_pushes() -> None:
    found = registered()
    fit = base_fit(found.campaign, found.start)
    model = Model((*fit.model.effects, ForceCurve(), TorqueCurve()))
    start = tuple(np.concatenate([t, np.zeros(6 * len(DEGREES))]) for t in fit.state.theta)
    wide = fit_campaign(found.campaign, CampaignState(fit.state.flights, start), model)
    for theta in wide.state.theta:
        in_plane = theta[model.slices[-2]].reshape(-1, 3)[:, :2]
        middle = basis(np.array([0.5 * (found.campaign.sequences[0].setting.times_s[-1])]), found.campaign.sequences[0].setting)[0]
        assert np.abs(middle @ in_plane).max() < 3.0


@pytest.mark.parametrize("term", TERMS, ids=lambda t: t.key)
def test_a_term_is_linear_in_its_amplitudes_and_nothing_at_zero(term: Term) -> None:
    rng = np.random.default_rng(4)
    theta = rng.uniform(0.5, 1.5, (5, len(term.parameters)))
    at = moment(5)
    doubled, none = theta.copy(), theta.copy()
    doubled[:, : term.amplitudes] *= 2.0
    none[:, : term.amplitudes] = 0.0
    np.testing.assert_allclose(term.function(doubled, at), 2.0 * term.function(theta, at), rtol=1e-12)
    np.testing.assert_array_equal(term.function(none, at), 0.0)


@pytest.mark.parametrize("term", TERMS, ids=lambda t: t.key)
def test_a_law_of_one_term_keeps_the_contracts_of_effects(term: Term) -> None:
    found = registered()
    sequence, flight = found.campaign.sequences[0], found.start.flights[0]
    shape = term.places(flight.x[None] + np.array([[0.0, 0.0, 0.0], [0.01, 0.01, 0.01]]))[-1]
    effect = law_effect("law", (term,), (shape,))
    broken = [kept for kept in check_contracts(effect, sequence, flight) if not kept.kept]
    assert not broken


def test_the_power_of_a_distance_and_of_a_speed() -> None:
    by_key = {t.key: t for t in TERMS}
    at = moment(3)
    near = replace(at, x=np.array([[0.05, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]]))
    wall = by_key["towards_plane"].function(np.tile([2.0, 0.0, 0.0, 0.0, 2.0], (3, 1)), near)
    np.testing.assert_allclose(wall, [[-2.0, 0.0, 0.0], [-0.5, 0.0, 0.0], [-0.125, 0.0, 0.0]], atol=1e-12)
    point = by_key["towards_point"].function(np.tile([2.0, 0.0, 0.0, 0.0, 2.0], (3, 1)), near)
    np.testing.assert_allclose(point, wall, atol=1e-12)
    drag = by_key["against_velocity"].function(np.tile([0.5, 2.0], (3, 1)), at)
    np.testing.assert_allclose(drag, -0.5 * np.linalg.norm(at.v, axis=1, keepdims=True) * at.v)
