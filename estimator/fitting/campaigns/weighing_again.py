"""Noise and fit in turn: what a fit shows of the noise and of the frames' random times is what the next one is weighed by.

What the sequences share and no parameter says, as the surfaces of their particles, is made anew less often (:func:`relinearised`).
"""

from dataclasses import replace

import numpy as np

from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.following import following
from estimator.likelihood.time_shifts import jitter_test
from estimator.motion.rigid_body import RanAway

WEIGHED, SETTLED = 6, 0.02
"""Times that noise and flights are fitted in turn at most, and the relative change of the noise after which both have settled."""
UNFLYABLE = (RanAway, np.linalg.LinAlgError)
"""What is raised where a model's flights run away."""


def weighed_again(campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignFit]:
    """A campaign in which every sequence has the noise that it most probably has at a fit, and the fit to that.

    So have the random times of the frames, where the fit has them: before another effect came, they stood for that, too.
    """
    for _ in range(WEIGHED):
        again, state = _with_noise(campaign, fit), _with_random_times(campaign, fit)
        if _change(campaign, again) < SETTLED and _change_of_times(fit, state) < SETTLED:
            break
        campaign, fit = again, fit_campaign(again, state, fit.model)
    return campaign, fit


def relinearised(campaign: Campaign, fit: CampaignFit, *, ended: bool = False) -> tuple[Campaign, CampaignFit]:
    """The campaign with what its sequences share and no parameter says made anew at a fit, and the fit to that.

    Where a search has ``ended`` at that fit: with what sequences have of errors of their own beside it.

    Both as they are if that is nothing, or where flights run away.
    """
    try:
        made, state = campaign.kind.ended(campaign, fit) if ended else campaign.kind.relinearised(campaign, fit)
        if made is campaign:
            return campaign, fit
        return weighed_again(*following(made, fit_campaign(made, state, _about(made, campaign, fit.model))))
    except UNFLYABLE:
        return campaign, fit


def _about(made: Campaign, campaign: Campaign, model: Model) -> Model:
    """The ``model`` of a campaign for one that was ``made`` of it, of whose flights something else may be known."""
    return Model((*made.kind.base.effects, *model.effects[len(campaign.kind.base.effects) :]))


def _with_noise(campaign: Campaign, fit: CampaignFit) -> Campaign:
    """Every sequence with the noise that a fit shows, where that is not read off the pictures."""
    scales = campaign.kind.noise_scales(campaign, fit.equations)
    if scales is None:
        return campaign
    tasks = (campaign.kind.with_noise(task, float(scale)) for task, scale in zip(campaign.sequences, scales, strict=True))
    return replace(campaign, sequences=tuple(tasks))


def _with_random_times(campaign: Campaign, fit: CampaignFit) -> CampaignState:
    """The state of a fit with the likeliest standard deviation of what its model draws anew in every frame."""
    places = [part for e, part in zip(fit.model.effects, fit.model.slices, strict=True) if e.random]
    if not places:
        return fit.state
    sigma = jitter_test(campaign.time_shifts(fit.equations)).sigma_s
    theta = tuple(each.copy() for each in fit.state.theta)
    for each in theta:
        each[places[0]] = sigma
    return replace(fit.state, theta=theta)


def _change(campaign: Campaign, other: Campaign) -> float:
    """Largest relative change of a sequence's noise."""
    noise = np.array([[each.kind.noise_of(task) for task in each.sequences] for each in (campaign, other)])
    return float(np.abs(noise[1] / noise[0] - 1.0).max(initial=0.0))


def _change_of_times(fit: CampaignFit, state: CampaignState) -> float:
    """Change of the random times' standard deviation over the larger of both."""
    old, new = (fit.model.random_sigma(each.theta[0]) if each.theta else 0.0 for each in (fit.state, state))
    return abs(new - old) / max(new, old, np.finfo(float).tiny)
