"""Fits a campaign with chosen effects, added one after the other, each from where a score test says that it begins.

A test of one effect alone gives the best of its starts (the frequency of a vibration, the place of a gap) and a first value, so a fit never
begins where an effect is flat.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from datasets.errors import InputError
from estimator.diagnosis.explain import start_with
from estimator.diagnosis.extending import fit_extended
from estimator.diagnosis.score_tests import Candidates, score_tests
from estimator.effects.link import EffectModel
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.following import following
from estimator.fitting.held_out import HeldOut, held_out


def base_fit(campaign: Campaign, start: CampaignState) -> CampaignFit:
    """Free flight alone."""
    model = campaign.kind.base
    return fit_campaign(campaign, start_with(start, model.size), model)


def with_effect(campaign: Campaign, fit: CampaignFit, effect: EffectModel) -> CampaignFit:
    """The campaign fitted with one effect more.

    Raises
    ------
    InputError
        Where no sequence is long enough to show it.
    """
    asked = Candidates.of(campaign, (effect,))
    if not asked.effects:
        longest = max((each.setting.times_s for each in campaign.sequences), key=len)
        came = f"{len(longest)} frames over {1e3 * float(np.ptp(longest)):.3g} ms"
        raise InputError(f"{effect.entry.key}: expected a sequence long enough to show it, came {came} at most.")
    tests, _ = score_tests(campaign, fit, asked)
    return fit_extended(campaign, fit, tests[0])


def fit_with(campaign: Campaign, start: CampaignState, effects: Sequence[EffectModel]) -> tuple[Campaign, CampaignFit]:
    """Free flight with all of ``effects``, and the campaign as it is at that fit (:mod:`estimator.fitting.following`)."""
    campaign, fit = following(campaign, base_fit(campaign, start))
    for effect in effects:
        campaign, fit = following(campaign, with_effect(campaign, fit, effect))
    return campaign, fit


@dataclass(frozen=True)
class Rung:
    """One step of a ladder: what was ``added`` (``None``: the base), the fit, and its errors on what it was not fitted to.

    ``campaign`` is as it is at the fit (:mod:`estimator.fitting.following`).
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
    """The base and then one effect more on every rung."""
    campaign, fit = following(campaign, base_fit(campaign, start))
    yield Rung(None, campaign, fit, held_out(campaign, fit.state, fit.model))
    told("base")
    for effect in effects:
        campaign, fit = following(campaign, with_effect(campaign, fit, effect))
        yield Rung(effect.entry.key, campaign, fit, held_out(campaign, fit.state, fit.model))
        told(effect.entry.key)
