"""The ladder of an explanation: free flight, and a rung for every effect that was found."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

from estimator.diagnosis.adding import with_effect
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.held_out import HeldOut, held_out
from tests.estimator.small_campaign import fitted, registered
from tumble.diagnosis_documents import explanation_ladder
from tumble.reports.words import rung_name


@cache
def with_drag() -> CampaignFit:
    return with_effect(registered().campaign, fitted(), MODELS["linear_drag"])[1]


@cache
def error() -> HeldOut:
    return held_out(registered().campaign, fitted().state, fitted().model)


def explained(*, found: bool) -> Any:
    """A drag that was found, with the held-out errors of free flight and of the drag."""
    worse = replace(error(), squares=tuple(4.0 * each for each in error().squares))
    step = SimpleNamespace(added="linear_drag", before=worse, after=error(), fit=with_drag())
    return SimpleNamespace(rungs=(step,) if found else (), begun=SimpleNamespace(fit=fitted()), campaign=registered().campaign)


def names() -> list[str]:
    return [sequence.name for sequence in registered().campaign.sequences]


def test_steps_are_rungs() -> None:
    rungs = explanation_ladder(explained(found=True), names())
    assert [rung_name(rung) for rung in rungs] == ["free flight", "+ linear_drag"]
    assert (rungs[0]["model"], rungs[1]["model"]) == ([], ["linear_drag"])
    assert rungs[0]["held_out"]["rms_px"] == 2.0 * rungs[1]["held_out"]["rms_px"]


def test_where_nothing_was_found_there_is_no_ladder() -> None:
    assert explanation_ladder(explained(found=False), names()) == []
