"""Covariance of every parameter of a fitted campaign: the sandwich of its normal matrix and of the noise of its gradient.

Noise is counted where it repeats: one silhouette's in all its pairs, one calibrated view's in all sightings of all sequences that use it,
the body-fixed error in all sequences of one particle, the prior's once [Cameron, Gelbach and Miller 2011].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, Layout, marginal_prior
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
        """Covariance of some of a sequence's 21 + q parameters; ``columns`` (c,): their numbers."""
        rows = self.place[sequence][columns]
        return self.covariance[np.ix_(rows, rows)]


def campaign_covariance(campaign: Campaign, fit: CampaignFit) -> CampaignCovariance:
    """Covariance of all parameters at a fit."""
    layout = fit.layout
    place, size = placed(layout, fit.model, len(campaign.sequences))
    first = size - layout.size
    H = np.zeros((size, size))
    H[first:, first:] = marginal_prior(campaign, layout, fit.model, fit.state).information
    prior, M = H.copy(), H.copy()
    weighted, more = [], campaign.kind.noise_ratio(campaign, fit.equations)
    for each, rows in zip(fit.equations, place, strict=True):
        H[np.ix_(rows, rows)] += each.frames.H
        M[np.ix_(rows, rows)] += each.frames.noisier(more)
        wide = np.zeros((*each.frames.weighted.shape[:-1], size))
        wide[..., rows] = each.frames.weighted
        weighted.append(wide)
    M += campaign.kind.repeated_noise(campaign, [e.errors for e in fit.equations], weighted)
    p = np.unique([rows[column] for rows in place for column in campaign.kind.considered]).astype(np.int64)
    x = np.setdiff1d(np.arange(size), p)
    inverse = stable_inverse(H[np.ix_(x, x)], 1e-13)
    covariance = np.zeros(H.shape)
    covariance[np.ix_(x, x)] = inverse @ M[np.ix_(x, x)] @ inverse
    if len(p):
        _consider(covariance, (x, p), inverse @ H[np.ix_(x, p)], np.asarray(np.linalg.inv(prior[np.ix_(p, p)]), dtype=np.float64))
    return CampaignCovariance(0.5 * (covariance + covariance.T), place)


def _consider(covariance: Array, where: tuple[Index, Index], A: Array, P: Array) -> None:
    """Add to a covariance (n, n) of what is fitted, the rows ``x``, what considered parameters, the rows ``p``, make of it [Schmidt 1966].

    ``A`` (x, p): by how much less what is fitted is where a considered parameter is larger; ``P`` (p, p) the prior's covariance.
    """
    x, p = where
    covariance[np.ix_(x, x)] += A @ P @ A.T
    covariance[np.ix_(x, p)], covariance[np.ix_(p, x)], covariance[np.ix_(p, p)] = -A @ P, -P @ A.T, P


def placed(layout: Layout, model: Model, sequences: int) -> tuple[tuple[Index, ...], int]:
    """Where the 21 + q parameters of every sequence lie among all, its own first and then what they share, and how many all are."""
    own, place = len(layout.local), []
    for i in range(sequences):
        rows = np.empty(N_PARAMETERS + model.size, dtype=np.int64)
        rows[layout.local] = i * own + np.arange(own)
        rows[layout.shared] = sequences * own + layout.place[i]
        place.append(rows)
    return tuple(place), sequences * own + layout.size
