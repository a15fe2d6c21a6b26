"""Covariance of every parameter of a fitted campaign: the sandwich of its normal matrix and of the noise of its gradient.

Noise is counted where it repeats: one silhouette's in all its pairs, one calibrated view's in all sightings of all sequences that use it,
the body-fixed error in all sequences of one particle, the prior's once [Cameron, Gelbach and Miller 2011].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.campaigns.campaign import Campaign, CampaignFit

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class CampaignCovariance:
    """``covariance`` (p, p) of all parameters; ``place`` [sequence] (21 + q,): where a sequence's parameters lie in it."""

    covariance: Array
    place: tuple[Index, ...]

    def of(self, sequence: int, columns: Index) -> Array:
        """Covariance of some of a sequence's 21 + q parameters; ``columns`` (c,): their numbers."""
        rows = self.place[sequence][columns]
        return self.covariance[np.ix_(rows, rows)]


def campaign_covariance(campaign: Campaign, fit: CampaignFit) -> CampaignCovariance:
    """Covariance of all parameters at a fit."""
    system, more = fit.system(campaign), campaign.kind.noise_ratio(campaign, fit.equations)
    errors, frames = [each.errors for each in fit.equations], [each.frames for each in fit.equations]
    repeated = campaign.kind.repeated_noise(campaign, errors, frames, fit.layout)
    noise = system.added(each.frames.noisier(more) for each in fit.equations) + repeated
    return CampaignCovariance(system.sandwich(noise), fit.layout.places)
