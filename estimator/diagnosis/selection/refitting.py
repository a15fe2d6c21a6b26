"""A campaign fitted with a set of effects, from where a linearised campaign says that their values lie."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.selection.evidence import Evidence
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.following import following
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
SHARES = (1.0, 0.5, 0.0)
"""Of the linear values at which a fit starts: where flights run away from there, closer to no effect."""
WEIGHED = 2
"""Times that noise and flights are fitted in turn."""
Set = tuple[int, ...]


def refitted(
    campaign: Campaign, fit: CampaignFit, evidence: Evidence, members: Set, *, follow: bool = True
) -> tuple[Campaign, CampaignFit]:
    """Fit a campaign with the effects ``members`` of a linearised campaign about ``fit``, and ``follow`` it.

    Every effect is held by the prior under which the set is most probable.

    Raises
    ------
    RanAway
        Where flights run away from every start.
    """
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


def weighed_again(campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignFit]:
    """A campaign in which every sequence has the noise that it most probably has at a fit, and the fit to that."""
    for _ in range(WEIGHED):
        scales = campaign.kind.noise_scales(campaign, fit.equations)
        if scales is None:
            break
        tasks = tuple(campaign.kind.with_noise(task, float(scale)) for task, scale in zip(campaign.sequences, scales, strict=True))
        campaign = replace(campaign, sequences=tasks)
        fit = fit_campaign(campaign, fit.state, fit.model)
    return campaign, fit


def _model(campaign: Campaign, evidence: Evidence, members: Set) -> Model:
    scales = dict(zip((e for e in members if len(evidence.of.rows(e))), evidence.scaled(members).scales, strict=True))
    effects = [_held(evidence, e, scales.get(e)) for e in members]
    return Model((*campaign.kind.base.effects, *effects))


def _held(evidence: Evidence, number: int, scale: float | None) -> EffectModel:
    """The effect under the prior of that scale: without it, what data cannot tell from another effect would run away."""
    effect = evidence.of.effects[number]
    if scale is None:
        return effect.held_by(None)
    limit = [max(map(abs, p.plausible)) for p in effect.entry.parameters]
    rows = evidence.of.rows(number)
    searched = {i for i, p in enumerate(effect.entry.parameters) if p.name not in effect.entry.sizes}
    seen = {evidence.of.columns[row].parameter: 1.0 / np.sqrt(evidence.of.information[row, row]) for row in rows}
    sigma = [np.inf if i in searched else scale * (each if np.isfinite(each) else seen[i]) for i, each in enumerate(limit)]
    return effect.held_by(tuple(float(each) for each in sigma))


def _values(campaign: Campaign, fit: CampaignFit, evidence: Evidence, members: Set, share: float) -> tuple[Array, ...]:
    """Parameters of every sequence: those of the base as they are, amplitudes at a ``share`` of the posterior mean."""
    fitted, lin = evidence.fitted(members), evidence.of
    mean = dict(zip(fitted.rows.tolist(), fitted.mean.tolist(), strict=True))
    size = campaign.kind.base.size
    sharing = {e: campaign.sharing(lin.effects[e].entry.scope) for e in members}
    found = []
    for number, theta in enumerate(fit.state.theta):
        parts = [theta[:size]]
        for e in members:
            parts.append(_of_effect(fit, (evidence, e), mean, number, share, sharing[e]))
        found.append(np.concatenate(parts))
    return tuple(found)


def _of_effect(fit: CampaignFit, of: tuple[Evidence, int], mean: dict[int, float], number: int, share: float, sharing) -> Array:
    """Parameters (q,) of one effect in sequence ``number``."""
    (evidence, e), effect = of, of[0].of.effects[of[1]]
    lin = evidence.of
    if effect.random:
        return np.array([lin.jitter.sigma_s])
    owner = number if effect.entry.scope is Scope.SEQUENCE else sharing[number] if len(set(sharing)) > 1 else None
    there = effect.entry.key in fit.model.keys
    own = fit.state.theta[number][fit.model.slices[fit.model.keys.index(effect.entry.key)]] if there else None
    value = own.copy() if own is not None else lin.start(e, owner).copy()
    for row in lin.rows(e):
        column = lin.columns[row]
        if column.sequence == owner:
            value[column.parameter] = share * mean[int(row)] + (0.0 if own is not None else value[column.parameter])
    return value if own is not None else effect.first_guess(value)
