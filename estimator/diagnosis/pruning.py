"""What a fitted model can do without, and what the effects that it lacks would explain."""

from collections.abc import Mapping

import numpy as np
from scipy.stats import chi2

from estimator.diagnosis.refits import Rules
from estimator.diagnosis.score_tests import Candidates, Tested, score_tests
from estimator.effects.choosing import beside
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.motion.flight import N_PARAMETERS


def tests_at(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel]) -> Tested:
    """Tests of the effects that can be in the model and are not, and their scores."""
    return score_tests(campaign, fit, Candidates.of(campaign, beside(fit.model.keys, catalogue)))


def pruned(campaign: Campaign, fit: CampaignFit, rules: Rules) -> tuple[CampaignFit, tuple[str, ...]]:
    """The fit without effects whose parameters are compatible with zero once all are there."""
    dropped: list[str] = []
    while True:
        covariance = campaign_covariance(campaign, fit)
        free = [e for e, effect in enumerate(fit.model.effects) if effect.held is None and not effect.random]
        weakest = max(
            ((wald_p(campaign, fit, covariance, e), e) for e in free),
            default=(0.0, -1),
        )
        if weakest[0] <= rules.superfluous:
            return fit, tuple(dropped)
        dropped.append(fit.model.effects[weakest[1]].entry.key)
        fit = without_effect(campaign, fit, weakest[1])


def without_effect(campaign: Campaign, fit: CampaignFit, number: int) -> CampaignFit:
    """The fit without effect ``number``."""
    model = Model(tuple(e for i, e in enumerate(fit.model.effects) if i != number))
    state = CampaignState(fit.state.flights, tuple(np.delete(t, np.r_[fit.model.slices[number]]) for t in fit.state.theta))
    return fit_campaign(campaign, state, model)


def wald_p(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance, number: int) -> float:
    """p-value of effect ``number`` being zero; parameters that are searched for do not count, and numbers of nothing are zero."""
    effect, part = fit.model.effects[number], fit.model.slices[number]
    parameters = effect.entry.parameters
    whole = [part.start + i for i, p in enumerate(parameters) if p.name in effect.whole]
    if whole and not any(np.rint(theta[whole]).any() for theta in fit.state.theta):
        return 1.0
    counted = [i for i, p in enumerate(parameters) if p.name in effect.entry.sizes]
    columns = part.start + np.array(counted)
    sequences = sorted(set(campaign.sharing(effect.entry.scope)))
    rows = np.concatenate([covariance.place[s][N_PARAMETERS + columns] for s in sequences])
    theta = np.concatenate([fit.state.theta[s][columns] for s in sequences])
    C = covariance.covariance[np.ix_(rows, rows)]
    statistic = float(theta @ np.linalg.pinv(C, rcond=1e-12, hermitian=True) @ theta)
    return float(chi2.sf(statistic, len(rows)))
