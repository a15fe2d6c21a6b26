"""Empirical terms on campaigns whose forces no effect of the catalogue is: the stage, what they remove, their shape, and the law."""

from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.vocabulary.effects import Stage
from estimator.diagnosis import empirical_fit
from estimator.diagnosis.diagnose import Unknown, diagnose
from estimator.diagnosis.empirical_fit import EmpiricalFit, LawFit, fit_empirical, fit_terms
from estimator.diagnosis.empirical_shape import empirical_shapes
from estimator.effects.empirical.law_effect import shown_terms
from estimator.effects.empirical.law_terms import TERMS, Term
from estimator.effects.model import Model
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.held_out import HeldOut
from estimator.fitting.descent import Effort
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.motion.flight import N_PARAMETERS
from estimator.motion.rigid_body import RanAway
from tests.estimator.made_balls import ball
from tests.estimator.unknown_campaigns import FORCES, THRUST, unknown_campaign

pytestmark = pytest.mark.long

Array = NDArray[np.float64]


@cache
def found(key: str) -> tuple[Unknown, EmpiricalFit]:
    registered = unknown_campaign(key)
    fit = base_fit(registered.campaign, registered.start)
    left = diagnose(registered.campaign, fit, {}).unknown
    return left, fit_empirical(registered.campaign, fit, left)


def values(law: LawFit) -> dict[str, tuple[float, float]]:
    """Values of the law's parameters with their standard deviations."""
    part = law.fit.model.slices[-1]
    sigma = np.sqrt(np.diag(law.covariance.of(0, N_PARAMETERS + np.arange(part.start, part.stop))))
    names = law.fit.model.effects[-1].entry.names
    return {n: (float(v), float(s)) for n, v, s in zip(names, law.fit.state.theta[0][part], sigma, strict=True)}


@pytest.mark.parametrize("key", FORCES)
def test_a_hidden_force_sits_in_the_dynamics_and_is_removed(key: str) -> None:
    left, empirical = found(key)
    assert left.present
    assert left.stage is Stage.DYNAMICS
    removed = empirical.removed
    assert removed.share > 0.8
    assert removed.floor_px < 0.8 * removed.before.rms_px
    assert removed.after.rms_px < 1.1 * removed.floor_px
    assert empirical.law is not None
    assert empirical.law.removed.share > 0.8


def test_balls_whose_spin_was_read_once_show_no_torque_and_no_axes_of_their_own() -> None:
    rng = np.random.default_rng(5)
    registered = register_trajectories([ball(rng, f"shot_{i}", wrong=False, drags=True) for i in range(4)])
    fit = base_fit(registered.campaign, registered.start)
    left = diagnose(registered.campaign, fit, {}).unknown
    assert left.stage is Stage.DYNAMICS
    empirical = fit_empirical(registered.campaign, fit, left)
    assert [term.entry.key for term in empirical.terms] == ["force_curve"]
    assert {shape.of for shape in empirical_shapes(registered.campaign, empirical)} == {"force, world axes"}
    assert empirical.removed.share > 0.9
    shown = {term.key for term in shown_terms(partial(registered.campaign.kind.why_not, registered.campaign))}
    assert {term.key for term in TERMS} - shown == {"body_fixed", "torque_constant", "torque_body_fixed", "against_spin"}


def test_the_law_of_a_thrust_is_fixed_to_the_body() -> None:
    _, empirical = found("outgassing_thrust")
    assert empirical.law is not None
    assert {t.key for t in empirical.law.terms} == {"body_fixed", "torque_body_fixed"}
    told = values(empirical.law)
    for axis in "123":
        value, sigma = told[f"thrust_{axis}"]
        assert abs(value - THRUST[f"a{axis}"]) < 4.0 * sigma
        assert sigma < 1.5


def test_a_thrust_is_a_constant_in_body_axes() -> None:
    left, empirical = found("outgassing_thrust")
    del left
    shapes = {(s.of, s.sequence): s for s in empirical_shapes(unknown_campaign("outgassing_thrust").campaign, empirical)}
    assert {of for of, _ in shapes} == {"force, world axes", "force, body axes", "torque, world axes", "torque, body axes"}
    for number in range(2):
        body = shapes["force, body axes", number]
        true = np.array([THRUST[f"a{axis}"] for axis in "123"])
        middle = slice(3, -3)
        pull = (body.value[middle] - true) / body.sigma[middle]
        assert np.mean(np.abs(pull) < 3.0) > 0.9
        world = shapes["force, world axes", number]
        np.testing.assert_allclose(np.linalg.norm(world.value, axis=1), np.linalg.norm(body.value, axis=1), rtol=1e-9)


def test_the_law_of_a_wall_depends_on_the_place_along_one_axis() -> None:
    _, empirical = found("wall_attraction")
    assert empirical.law is not None
    assert [t.key for t in empirical.law.terms] == ["towards_plane"]
    told = values(empirical.law)
    assert abs(told["azimuth"][0]) < 0.2
    (exponent,) = empirical.law.law.exponents
    assert exponent.interval[0] < 2.0 < exponent.interval[1]


def test_a_lens_that_drifts_is_a_magnification_over_time_without_a_law() -> None:
    left, empirical = found("thermal_focus_drift")
    assert (left.present, left.stage) == (True, Stage.OPTICS)
    assert empirical.removed.share > 0.8
    assert empirical.law is None
    (shape,) = empirical_shapes(unknown_campaign("thermal_focus_drift").campaign, empirical)
    assert (shape.of, shape.sequence, shape.over) == ("magnification minus 1", None, ("time_s",))
    assert shape.value.shape == shape.sigma.shape == (len(shape.place), 1)
    assert np.all(np.isfinite(shape.sigma))


@cache
def wall() -> tuple[Campaign, EmpiricalFit, CampaignFit]:
    """The campaign of a wall, its empirical fit and free flight."""
    registered = unknown_campaign("wall_attraction")
    return registered.campaign, found("wall_attraction")[1], base_fit(registered.campaign, registered.start)


def a_plane(empirical: EmpiricalFit) -> tuple[tuple[Term, Array], ...]:
    """The law of the wall as it was found."""
    law = empirical.law
    assert law is not None
    return ((law.terms[0], law.fit.state.theta[0][law.fit.model.slices[-1]]),)


def test_a_law_starts_where_the_free_force_has_brought_the_flights_and_then_at_no_force(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, empirical, fit = wall()
    starts = []

    def unsettled(campaign: Campaign, start: CampaignState, model: Model, _effort: Effort) -> CampaignFit:
        starts.append(start)
        return replace(fit_campaign(campaign, start, model, Effort(0, 0)), settled=False)

    monkeypatch.setattr(empirical_fit, "fit_campaign", unsettled)
    assert fit_terms(campaign, fit, a_plane(empirical), empirical.fit) is not None
    first, second = starts
    assert first.flights is empirical.fit.state.flights
    assert second.flights is fit.state.flights
    assert first.theta[0][-5] != 0.0
    assert second.theta[0][-5] == 0.0
    np.testing.assert_array_equal(first.theta[0][-4:], second.theta[0][-4:])


def test_a_law_under_which_flights_run_away_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, empirical, fit = wall()

    def away(*_of: Any) -> CampaignFit:
        raise RanAway("away")

    monkeypatch.setattr(empirical_fit, "fit_campaign", away)
    assert fit_terms(campaign, fit, a_plane(empirical), empirical.fit) is None


def test_a_fit_that_explains_less_than_no_law_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, empirical, fit = wall()

    def worse(campaign: Campaign, start: CampaignState, model: Model, _effort: Effort) -> CampaignFit:
        return replace(fit_campaign(campaign, start, model, Effort(0, 0)), cost=fit.cost, settled=True)

    monkeypatch.setattr(empirical_fit, "fit_campaign", worse)
    assert fit_terms(campaign, fit, a_plane(empirical), empirical.fit) is None


def test_a_law_that_predicts_worse_than_the_model_without_it_is_not_proposed(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, _, fit = wall()
    left, _ = found("wall_attraction")
    judged = iter((1.0, 0.2, 1.0))  # without anything, with free forces, with the law
    monkeypatch.setattr(empirical_fit, "held_out", lambda *_of: HeldOut((np.array([next(judged) ** 2]),), (np.ones(1),)))
    again = fit_empirical(campaign, fit, left)
    assert again.law is None
    assert again.removed.after.rms_px == 0.2
