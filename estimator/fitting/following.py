"""A campaign whose sequences follow the fit: what was made of them at earlier flights is made anew once the fit has left those."""

from dataclasses import replace

from estimator.fitting.campaign import Campaign, CampaignFit, fit_campaign

ROUNDS = 3


def following(campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignFit]:
    """The campaign made at a fit's flights and the fit to that; both as they are where the flights have hardly moved."""
    for _ in range(ROUNDS):
        made = tuple(
            campaign.kind.followed(sequence, flight, fit.model, theta)
            for sequence, flight, theta in zip(campaign.sequences, fit.state.flights, fit.state.theta, strict=True)
        )
        if all(new is old for new, old in zip(made, campaign.sequences, strict=True)):
            break
        campaign = replace(campaign, sequences=made)
        fit = fit_campaign(campaign, fit.state, fit.model)
    return campaign, fit
