"""Fits a campaign with chosen effects, added one after the other, each from where its evidence says that it begins.

The linearised campaign gives the best of an effect's starts (the frequency of a vibration, the place of a gap), a first value and the
scale of its prior, so a fit never begins where an effect is flat.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from datasets.errors import InputError
from estimator.diagnosis.score_tests import Candidates
from estimator.diagnosis.selection.evidence import Evidence
from estimator.diagnosis.selection.linearised import linearised
from estimator.diagnosis.selection.refitting import refitted
from estimator.diagnosis.selection.stated import with_facts
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState
from estimator.fitting.campaigns.following import following
from estimator.fitting.campaigns.held_out import HeldOut, held_out
from estimator.fitting.campaigns.weighing_again import relinearised, weighed_again


def with_effect(campaign: Campaign, fit: CampaignFit, effect: EffectModel) -> tuple[Campaign, CampaignFit]:
    """The campaign fitted with one effect more, and as it is at that fit.

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
    of = with_facts(linearised(campaign, fit, {effect.entry.key: effect}), campaign)
    return refitted(campaign, fit, Evidence(of), tuple(range(len(of.effects))))


def fit_with(campaign: Campaign, start: CampaignState, effects: Sequence[EffectModel]) -> tuple[Campaign, CampaignFit]:
    """Free flight with all of ``effects``, and the campaign as it is at that fit (:mod:`estimator.fitting.campaigns.following`)."""
    campaign, fit = relinearised(*weighed_again(*following(campaign, base_fit(campaign, start))))
    for effect in effects:
        campaign, fit = with_effect(campaign, fit, effect)
    return relinearised(campaign, fit) if effects else (campaign, fit)


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
    campaign, fit = fit_with(campaign, start, ())
    reached: list[tuple[str | None, Campaign, CampaignFit]] = [(None, campaign, fit)]
    for effect in effects:
        campaign, fit = with_effect(campaign, fit, effect)
        reached.append((effect.entry.key, campaign, fit))
    if effects:
        reached[-1] = (effects[-1].entry.key, *relinearised(campaign, fit))
    for key, where, at in reached:
        yield Rung(key, where, at, held_out(reached[-1][1], at.state, at.model))
        told(key or "base")
