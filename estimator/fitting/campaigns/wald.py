"""Whether a fitted effect is compatible with none [Wald 1943]."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from datasets.vocabulary.effects import Scope
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance
from estimator.motion.flight import LAYOUT

Array = NDArray[np.float64]


def wald_p(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance, number: int) -> float:
    """p-value of effect ``number`` being zero; parameters that are searched for do not count, and numbers of nothing are zero."""
    effect, part = fit.model.effects[number], fit.model.slices[number]
    parameters = effect.entry.parameters
    whole = [part.start + i for i, p in enumerate(parameters) if p.name in effect.whole]
    if whole and not any(np.rint(theta[whole]).any() for theta in fit.state.theta):
        return 1.0
    counted = [i for i, p in enumerate(parameters) if p.name in effect.entry.sizes]
    return zero_p(campaign, fit, covariance, effect.entry.scope, part.start + np.array(counted))


def zero_p(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance, scope: Scope, columns: NDArray[np.int64]) -> float:
    """p-value of ``columns`` (c,) of the effects' parameters being zero in all sequences; the data may say nothing of some."""
    sequences = sorted(set(campaign.sharing(scope)))
    rows = np.concatenate([covariance.place[s][LAYOUT.size + columns] for s in sequences])
    theta = np.concatenate([fit.state.theta[s][columns] for s in sequences])
    return p_of_zero(theta, covariance.covariance[np.ix_(rows, rows)])


def p_of_zero(theta: Array, C: Array) -> float:
    """p-value of ``theta`` (c,), with covariance ``C`` (c, c), being zero."""
    return float(chdtrc(len(theta), float(theta @ np.linalg.pinv(C, rcond=1e-12, hermitian=True) @ theta)))
