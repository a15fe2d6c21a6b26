"""The ladder of an explanation: rungs of accepted steps, and one for the last model where it has less."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import pytest

from estimator.diagnosis.adding import with_effect
from estimator.effects.registry import MODELS
from estimator.fitting.campaign import CampaignFit
from estimator.fitting.held_out import HeldOut, held_out
from tests.estimator.small_campaign import fitted, registered
from tumble.diagnosis_documents import explanation_ladder
from tumble.reports.words import rung_name


@cache
def with_drag() -> CampaignFit:
    return with_effect(registered().campaign, fitted(), MODELS["linear_drag"])


@cache
def error() -> HeldOut:
    return held_out(registered().campaign, fitted().state, fitted().model)


def explained(last: CampaignFit, *, accepted: bool = True) -> Any:
    """A drag that was tried, and the model it ended in, with another held-out error."""
    worse = replace(error(), rms_px=2.0 * error().rms_px)
    step = SimpleNamespace(added="linear_drag", accepted=accepted, before=worse, after=error(), fit=with_drag())
    return SimpleNamespace(steps=(step,), base=fitted(), fit=last, held_out=replace(error(), rms_px=3.0 * error().rms_px))


def names() -> list[str]:
    return [sequence.name for sequence in registered().campaign.sequences]


def test_accepted_steps_are_rungs() -> None:
    rungs = explanation_ladder(explained(with_drag()), names())
    assert [rung_name(rung) for rung in rungs] == ["free flight", "+ linear_drag"]
    assert rungs[0]["held_out"]["rms_px"] == 2.0 * rungs[1]["held_out"]["rms_px"]


def test_a_last_model_without_an_effect_has_a_rung_of_its_own() -> None:
    rungs = explanation_ladder(explained(fitted()), names())
    assert [rung_name(rung) for rung in rungs] == ["free flight", "+ linear_drag", "without linear_drag"]
    assert rungs[-1]["model"] == rungs[0]["model"]
    assert rungs[-1]["held_out"]["rms_px"] == pytest.approx(3.0 * error().rms_px)


def test_a_refused_step_drops_nothing() -> None:
    assert [rung_name(rung) for rung in explanation_ladder(explained(fitted(), accepted=False), names())] == ["free flight"]
