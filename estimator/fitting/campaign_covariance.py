"""Covariance of every parameter of a fitted campaign: the sandwich of its normal matrix and of the noise of its gradient.

Noise is counted where it repeats: one silhouette's in all its pairs, one calibrated view's in all sightings of all sequences that use it,
the body-fixed error in all sequences of one particle, the prior's once [Cameron, Gelbach and Miller 2011].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.campaign import Campaign, CampaignFit, shared_prior
from estimator.fitting.stable_inverse import stable_inverse
from estimator.motion.flight import N_PARAMETERS

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class CampaignCovariance:
    """``covariance`` (p, p) of all parameters; ``place`` [sequence] (21 + q,): where a sequence's parameters lie in it."""

    covariance: Array
    place: tuple[Index, ...]

    def of(self, sequence: int, columns: Index) -> Array:
        """Covariance of some of a sequence's 21 + q parameters."""
        rows = self.place[sequence][columns]
        return self.covariance[np.ix_(rows, rows)]


def campaign_covariance(campaign: Campaign, fit: CampaignFit) -> CampaignCovariance:
    """Covariance of all parameters at a fit."""
    layout, n = fit.layout, len(campaign.sequences)
    own = len(layout.local)
    size = n * own + layout.size
    place = []
    for i in range(n):
        rows = np.empty(N_PARAMETERS + fit.model.size, dtype=np.int64)
        rows[layout.local] = i * own + np.arange(own)
        rows[layout.shared] = n * own + layout.place[i]
        place.append(rows)
    H = np.zeros((size, size))
    H[n * own :, n * own :] = shared_prior(campaign, layout, fit.model, fit.state).information
    M = H.copy()
    weighted, more = [], campaign.kind.noise_ratio(campaign, fit.equations)
    for each, rows in zip(fit.equations, place, strict=True):
        H[np.ix_(rows, rows)] += each.frames.H
        M[np.ix_(rows, rows)] += each.frames.noisier(more)
        wide = np.zeros((*each.frames.weighted.shape[:-1], size))
        wide[..., rows] = each.frames.weighted
        weighted.append(wide)
    M += campaign.kind.repeated_noise(campaign, [e.errors for e in fit.equations], weighted)
    inverse = stable_inverse(H, 1e-13)
    covariance = inverse @ M @ inverse
    return CampaignCovariance(0.5 * (covariance + covariance.T), tuple(place))
