"""A campaign fitted with a set of effects, from where a linearised campaign says that their values lie."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.selection.evidence import Evidence
from estimator.diagnosis.selection.linearised import linearised
from estimator.diagnosis.selection.stated import with_facts
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.following import following
from estimator.fitting.campaigns.weighing_again import UNFLYABLE, weighed_again
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
SHARES = (1.0, 0.5, 0.0)
"""Of the linear values at which a fit starts: where flights run away from there, closer to no effect."""
TURNS = 4
"""Times that priors are made anew at most: a bound, of the table tennis shots one was enough. By judgement."""
Set = tuple[int, ...]


def refitted(
    campaign: Campaign, fit: CampaignFit, evidence: Evidence, members: Set, *, follow: bool = True
) -> tuple[Campaign, CampaignFit]:
    """Fit a campaign with those effects of ``members`` of a linearised campaign that act, about ``fit``, and ``follow`` it.

    Every effect is held by the prior under which the set is most probable.

    Raises
    ------
    RanAway
        Where flights run away from every start.
    """
    members = tuple(evidence.acting(members))
    model = _model(campaign, evidence, members)
    for share in SHARES:
        state = CampaignState(fit.state.flights, _values(campaign, fit, evidence, members, share))
        try:
            new = fit_campaign(campaign, state, model)
            return weighed_again(*following(campaign, new)) if follow else (campaign, new)
        except (RanAway, np.linalg.LinAlgError):
            if share == SHARES[-1]:
                raise
    raise AssertionError("unreachable")


def evidence_about(campaign: Campaign, fit: CampaignFit, more: Mapping[str, EffectModel]) -> Evidence:
    """Of all sets of a fit's effects and ``more``, linearised about the fit, beside what is stated."""
    return Evidence(with_facts(linearised(campaign, fit, more), campaign))


def held_anew(campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignFit]:
    """Fitted under the most probable priors where noise of what was measured is among the effects: about a fit others may be, so in turn.

    As far as flights do not run away.
    """
    for _ in range(TURNS if any(effect.noise for effect in fit.model.effects) else 0):
        evidence = evidence_about(campaign, fit, {})
        members = tuple(range(len(evidence.of.effects)))
        pairs = zip(_model(campaign, evidence, tuple(evidence.acting(members))).effects, fit.model.effects, strict=True)
        if all(np.allclose(new.held, old.held) for new, old in pairs if new.held and old.held):
            break
        try:
            campaign, fit = refitted(campaign, fit, evidence, members)
        except UNFLYABLE:
            break
    return campaign, fit


def _model(campaign: Campaign, evidence: Evidence, members: Set) -> Model:
    scales = dict(zip(evidence.sized(members), evidence.scaled(members).scales, strict=True))
    effects = [_held(evidence, e, scales.get(e)) for e in members]
    return Model((*campaign.kind.base.effects, *effects))


def _held(evidence: Evidence, number: int, scale: float | None) -> EffectModel:
    """The effect under the prior of that scale: without it, what data cannot tell from another effect would run away."""
    effect = evidence.of.effects[number]
    if scale is None:
        return effect.held_by(None)
    limits = evidence.limits(number)
    sigma = tuple(float(scale * limits[i]) if i in limits else np.inf for i in range(len(effect.entry.parameters)))
    return effect.held_by(sigma, tails=effect.entry.scope.own)


def _values(campaign: Campaign, fit: CampaignFit, evidence: Evidence, members: Set, share: float) -> tuple[Array, ...]:
    """Parameters of every sequence: those of the base as they are, amplitudes at a ``share`` of the posterior mean."""
    fitted = evidence.fitted(members)
    mean = dict(zip(fitted.rows.tolist(), (share * fitted.mean).tolist(), strict=True))
    found = [[theta[: campaign.kind.base.size]] for theta in fit.state.theta]
    for e in members:
        for number, parts in enumerate(found):
            parts.append(_of_effect(campaign, fit, (evidence, e), mean, number))
    return tuple(np.concatenate(parts) for parts in found)


def _of_effect(campaign: Campaign, fit: CampaignFit, of: tuple[Evidence, int], mean: dict[int, float], number: int) -> Array:
    """Parameters (q,) of one effect in sequence ``number``; ``mean`` of the columns in use: nothing where no start was worth its search."""
    lin, e = of[0].of, of[1]
    effect = lin.effects[e]
    if effect.random:
        return np.array([lin.jitter.sigma_s])
    owner = _owner(campaign, effect, number)
    there = effect.entry.key in fit.model.keys
    if there:
        value = fit.state.theta[number][fit.model.slices[fit.model.keys.index(effect.entry.key)]].copy()
    else:
        value = lin.start(e, owner).copy()
    for row in lin.rows(e):
        column = lin.columns[row]
        if column.sequence == owner:
            value[column.parameter] = mean.get(int(row), 0.0) + (0.0 if there else value[column.parameter])
    return value if there else effect.first_guess(value)


def _owner(campaign: Campaign, effect: EffectModel, number: int) -> int | None:
    """The sequence that the columns of an effect in sequence ``number`` belong to; ``None`` where all share them."""
    sharing = campaign.sharing(effect.entry.scope)
    return sharing[number] if effect.entry.scope.own or len(set(sharing)) > 1 else None
