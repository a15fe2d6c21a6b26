"""What a diagnosis says of a model that lacks an effect, of one that has it, and of one that has its alias."""

from functools import cache

import pytest

from estimator.diagnosis.adding import fit_with
from estimator.diagnosis.diagnose import ALPHA, Diagnosis, diagnose
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tumble.reports.verdict import verdict_of


@cache
def diagnosed(*effects: str) -> Diagnosis:
    """Of four flights with drag."""
    found = register_trajectories(campaign(6, Hidden(drag=0.3), Tracker()))
    return diagnose(*fit_with(found.campaign, found.start, [catalogue()[key] for key in effects]), catalogue())


def test_what_is_missing_is_named_with_its_odds() -> None:
    found = diagnosed()
    best = found.findings[0]
    assert found.missing == ("quadratic_drag",)
    assert found.group[0] == best.key == "quadratic_drag"
    assert found.p < ALPHA
    assert found.probability < 1e-3
    assert best.log_odds > 10.0
    assert best.probability > 0.5
    assert best.share > 0.9
    assert [f.log_odds for f in found.findings] == sorted((f.log_odds for f in found.findings), reverse=True)
    assert verdict_of(found).add == ("quadratic_drag",)
    assert not found.unknown.present


def test_a_model_that_has_the_effect_lacks_nothing() -> None:
    found = diagnosed("quadratic_drag")
    assert found.missing == found.group == ()
    assert verdict_of(found).kind == "nothing missing"
    assert found.findings[0].log_odds < 0.0
    assert "quadratic_drag" not in {f.key for f in found.findings}


@pytest.mark.parametrize("alias", ["length_scale", "frame_rate", "gravity"])
def test_an_alias_that_is_in_the_model_is_no_reason_to_say_that_something_is_missing(alias: str) -> None:
    """A gravity, a frame rate and a scale of lengths are one number: whichever is in the model, nothing is left to explain."""
    found = register_trajectories(campaign(11, Hidden(more_gravity=0.2), Tracker()))
    said = diagnose(*fit_with(found.campaign, found.start, [catalogue()[alias]]), catalogue())
    assert said.findings[0].log_odds < 0.0, "beside its alias nothing explains anything"
    assert said.missing == ()
    assert verdict_of(said).kind == "nothing missing"
