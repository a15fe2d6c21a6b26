"""The fit of the base model: free flight with what is known of the instrument, from where a campaign was registered."""

import numpy as np

from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign


def base_fit(campaign: Campaign, start: CampaignState) -> CampaignFit:
    """The base model alone."""
    model = campaign.kind.base
    return fit_campaign(campaign, start_with(start, model.size), model)


def start_with(state: CampaignState, size: int) -> CampaignState:
    """Flights with ``size`` effect parameters at zero."""
    return CampaignState(state.flights, tuple(np.zeros(size) for _ in state.flights))
