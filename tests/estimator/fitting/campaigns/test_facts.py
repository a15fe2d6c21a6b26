"""Facts in the fit: a stated length is one more measurement of the length scale."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.adding import fit_with
from estimator.effects.choosing import chosen_effects
from estimator.fitting.campaigns.campaign import layout_of
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.facts import Fact, stated_rows
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.reports.campaign_reporting import effect_values
from tests.estimator.made_trajectories import Hidden, Tracker, campaign


@pytest.fixture(scope="module")
def registered() -> Registered:
    """Three flights, gravity too strong by 2% as seen."""
    return register_trajectories(campaign(3, Hidden(more_gravity=0.2), Tracker(rows=60, orientation=False), sequences=3))


def scale_of(registered: Registered, *facts: Fact) -> tuple[float, float]:
    at, fit = fit_with(replace(registered.campaign, facts=facts), registered.start, chosen_effects("length_scale"))
    (value,) = effect_values(replace(registered, campaign=at), fit, campaign_covariance(at, fit))
    return value.value, value.sigma


def stated(value: float, sigma: float) -> Fact:
    return Fact("length_scale", (("length_scale", (1.0,)),), value, sigma)


def test_value_and_sigma_are_the_weighted_mean_of_data_and_fact(registered: Registered) -> None:
    value, sigma = scale_of(registered)
    fact = stated(value + 3.0 * sigma, 0.7 * sigma)
    both, joint = scale_of(registered, fact)
    weight = np.array([1.0 / sigma**2, 1.0 / fact.sigma**2])
    # The prior of the evidence is refitted beside the fact: it is wide, and moves the mean by less than a tenth of sigma.
    assert both == pytest.approx((weight @ [value, fact.value]) / weight.sum(), abs=0.1 * sigma)
    assert joint == pytest.approx(weight.sum() ** -0.5, rel=0.02)


def test_a_fact_about_an_effect_that_is_not_in_the_model_has_no_row(registered: Registered) -> None:
    _, fit = fit_with(registered.campaign, registered.start, chosen_effects("length_scale"))
    layout = layout_of(registered.campaign, fit.model)
    A, y = stated_rows((Fact("g", (("gravity", (0.0, 0.0, 1.0)),), 0.1, 0.01),), fit.model, layout)
    assert A.shape == (0, layout.size)
    assert y.shape == (0,)
    A, y = stated_rows((stated(0.02, 0.01),), fit.model, layout)
    assert (A.sum(), y.tolist()) == (100.0, [2.0])


def test_what_is_stated_of_a_particle_holds_for_each_of_them() -> None:
    flights = campaign(3, Hidden(), Tracker(rows=12, orientation=False), sequences=2)
    two = [replace(t, surroundings=replace(t.surroundings, particle=name)) for t, name in zip(flights, "ab", strict=True)]
    registered = register_trajectories(two)
    (drag,) = chosen_effects("linear_drag")
    _, fit = fit_with(registered.campaign, registered.start, [drag])
    A, _ = stated_rows((Fact("d", (("linear_drag", (1.0,)),), 0.0, 1.0),), fit.model, fit.layout)
    assert A.sum(axis=0).max() == 1.0
    assert A.shape[0] == 2
