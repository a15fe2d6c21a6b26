"""Fits a campaign with chosen effects, added one after the other, each from where its evidence says that it begins.

The linearised campaign gives the best of an effect's starts (the frequency of a vibration, the place of a gap), a first value and the
scale of its prior, so a fit never begins where an effect is flat.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from datasets.errors import InputError
from estimator.diagnosis.score_tests import Candidates
from estimator.diagnosis.selection.refitting import evidence_about, held_anew, refitted
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState
from estimator.fitting.campaigns.following import following
from estimator.fitting.campaigns.held_out import HeldOut, held_out
from estimator.fitting.campaigns.weighing_again import relinearised, weighed_again


def with_effect(
    campaign: Campaign, fit: CampaignFit, effect: EffectModel, idle: Sequence[EffectModel] = ()
) -> tuple[Campaign, CampaignFit]:
    """The campaign fitted with one effect more, and as it is at that fit; and with those that were ``idle`` without it.

    Raises
    ------
    InputError
        Where no sequence is long enough to show it.
    """
    reason = campaign.kind.why_not(campaign, effect)
    if reason is not None:
        raise InputError(f"{effect.entry.key} does not apply to these measurements: {reason}.")
    if not Candidates.of(campaign, (effect,)).effects:
        longest = max((each.setting.times_s for each in campaign.sequences), key=len)
        got = f"{len(longest)} frames over {1e3 * float(np.ptp(longest)):.3g} ms"
        raise InputError(f"{effect.entry.key}: expected a sequence long enough to show it, got {got} at most.")
    return _as_probable(campaign, fit, {each.entry.key: each for each in (*idle, effect)})


def _as_probable(campaign: Campaign, fit: CampaignFit, more: Mapping[str, EffectModel]) -> tuple[Campaign, CampaignFit]:
    """A campaign fitted with the effects of a fit and some ``more`` under the priors that the evidence has for all of them."""
    evidence = evidence_about(campaign, fit, more)
    return refitted(campaign, fit, evidence, tuple(range(len(evidence.of.effects))))


def fit_with(campaign: Campaign, start: CampaignState, effects: Sequence[EffectModel]) -> tuple[Campaign, CampaignFit]:
    """Free flight with all of ``effects``, and the campaign as it is at that fit (:mod:`estimator.fitting.campaigns.following`)."""
    return _one_by_one(campaign, start, effects)[-1]


def _one_by_one(campaign: Campaign, start: CampaignState, effects: Sequence[EffectModel]) -> list[tuple[Campaign, CampaignFit]]:
    """The base, then one effect more each time; the last one about priors, surfaces and noise that follow its effects."""
    reached = [relinearised(*weighed_again(*following(campaign, base_fit(campaign, start))))]
    for number, effect in enumerate(effects):
        reached.append(with_effect(*reached[-1], effect, effects[:number]))
    return [*reached[:-1], held_anew(*relinearised(*reached[-1]))] if effects else reached


@dataclass(frozen=True)
class Rung:
    """One step of a ladder: what was ``added`` (``None``: the base), the fit, and its errors on what it was not fitted to.

    ``campaign`` is as it is at the fit (:mod:`estimator.fitting.campaigns.following`).
    """

    added: str | None
    campaign: Campaign
    fit: CampaignFit
    held_out: HeldOut


def ladder(
    campaign: Campaign,
    start: CampaignState,
    effects: Sequence[EffectModel],
    *,
    told: Callable[[str], None] = lambda _added: None,
) -> Iterator[Rung]:
    """The base and then one effect more on every rung, all judged in the campaign that the last one is fitted in."""
    reached = _one_by_one(campaign, start, effects)
    for key, (where, at) in zip((None, *(effect.entry.key for effect in effects)), reached, strict=True):
        yield Rung(key, where, at, held_out(reached[-1][0], at.state, at.model))
        told(key or "base")
