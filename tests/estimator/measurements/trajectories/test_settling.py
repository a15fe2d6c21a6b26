"""A fit that ended too early goes on until its next step is small."""

from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.descent import Effort
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.reports.campaign_reporting import MOST_TO_GO, left_to_go, settled_fit
from tests.estimator.made_trajectories import Hidden, Tracker, campaign


def test_a_fit_that_ended_too_early_goes_on() -> None:
    registered = register_trajectories(campaign(6, Hidden(drag=0.3), Tracker(rows=24)))
    drag = catalogue()["quadratic_drag"]
    guesses = tuple(drag.first_guess(drag.starts(sequence.setting)[0]) for sequence in registered.campaign.sequences)
    start = CampaignState(registered.start.flights, guesses)

    def to_go(fit: CampaignFit) -> float:
        return left_to_go(registered, fit, campaign_covariance(registered.campaign, fit))

    early = fit_campaign(registered.campaign, start, Model((drag,)), Effort(1, 1))
    assert to_go(early) >= MOST_TO_GO
    assert to_go(settled_fit(registered, early)) < MOST_TO_GO
