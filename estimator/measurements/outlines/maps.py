"""Is there anything to explain in outlines sample by sample, and where: against what changes from frame to frame."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from estimator.diagnosis.noise_floor import NoiseFloor
from estimator.diagnosis.residual_maps import ResidualMap, even
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.measurements.trajectories.noise_floor import trajectory_floor

Array = NDArray[np.float64]


def outline_floor(campaign: Campaign, fit: CampaignFit, rng: np.random.Generator) -> NoiseFloor:
    """Judge the residuals of a fit, in standard deviations of the noise."""
    return trajectory_floor(campaign, fit, rng)


def outline_maps(campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
    """All maps of a fit, those that show most first."""
    frame = np.concatenate([np.repeat(np.arange(len(each.errors.e)), each.errors.seen.sum(axis=1)) for each in fit.equations])
    e = np.concatenate([each.errors.e[each.errors.seen] for each in fit.equations])
    axis = even("time", "time", "frame", frame.astype(np.float64))
    count = np.bincount(axis.bin, minlength=len(axis.centre))
    kept = np.flatnonzero(count)
    mean = np.bincount(axis.bin, e, len(axis.centre))[kept] / count[kept]
    sigma = 1.0 / np.sqrt(count[kept])
    statistic = float(np.sum((mean / sigma) ** 2))
    return (ResidualMap(axis, "offset", kept, mean, sigma, count[kept], statistic, float(chdtrc(len(kept), statistic)), "σ"),)
