"""A campaign whose sequences follow the fit: what was made of them at earlier flights is made anew once the fit has left those."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, fit_campaign
from estimator.fitting.side_by_side import each_of

ROUNDS = 3
"""Of making tables at the fitted flights and fitting again at most (notebook 23)."""
POOR = 10.0
"""Mean square of a fit's standardised errors, beyond which one round does: what is missing outweighs what tables can be wrong by.

See notebook 34."""


def following(campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignFit]:
    """The campaign made at a fit's flights and the fit to that; both as they are where the flights have hardly moved."""
    for done in range(ROUNDS):
        if done and _mean_square(fit) > POOR:
            break
        made = each_of(partial(_followed, campaign, fit), range(len(campaign.sequences)), campaign)
        if all(new is old for new, old in zip(made, campaign.sequences, strict=True)):
            break
        campaign = replace(campaign, sequences=tuple(made))
        fit = fit_campaign(campaign, fit.state, fit.model)
    return campaign, fit


def _followed(campaign: Campaign, fit: CampaignFit, number: int) -> Any:
    flight, theta = fit.state.flights[number], fit.state.theta[number]
    return campaign.kind.followed(campaign.sequences[number], flight, fit.model, theta)


def _mean_square(fit: CampaignFit) -> float:
    """Mean square of the standardised errors of all sequences, 1 where they are as large as the noise model says."""
    return float(np.sum([e.frames.chi2.sum() for e in fit.equations]) / max(np.sum([e.frames.count.sum() for e in fit.equations]), 1))
