"""Is there anything to explain in a campaign of trajectories? Residuals against what changes from row to row.

As for silhouettes, half the mean square of the change from one row to the next is noise whatever the model [von Neumann 1941]; where noise
of neighbouring rows is alike by ``rho``, that is ``1 - rho`` of its variance. Residuals are in standard deviations of each channel's noise.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.noise_floor import LAGS, NoiseFloor, Sums, floor_of
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit

Array = NDArray[np.float64]


def trajectory_floor(campaign: Campaign, fit: CampaignFit, rng: np.random.Generator) -> NoiseFloor:
    """Judge the residuals of a fit, in standard deviations of the noise; rows that jump are what that is measured by."""
    both = zip(campaign.sequences, fit.equations, strict=True)
    sums = [_sums(each.errors.e, each.errors.seen, task.repeats) for task, each in both]
    return floor_of(sums, _autocorrelation([each.errors.e for each in fit.equations]), rng)


def _sums(e: Array, seen: NDArray[np.bool_], repeats: Array) -> Sums:
    """Squared changes are over what they are of the noise."""
    rho = (repeats - 1.0) / (repeats + 1.0)
    both = np.vstack([seen[1:] & seen[:-1], np.zeros((1, e.shape[1]), dtype=np.bool_)])
    following = np.vstack([e[1:], np.zeros((1, e.shape[1]))])
    change = np.where(both, 0.5 * (following - e) ** 2 / (1.0 - rho), 0.0).sum(axis=1)
    product = np.where(both, following * e, 0.0).sum(axis=1)
    return Sums((e**2).sum(axis=1), seen.sum(axis=1).astype(np.float64), change, product, both.sum(axis=1).astype(np.float64))


def _autocorrelation(residuals: Sequence[Array]) -> Array:
    """Correlation (l,) of residuals with those ``LAGS`` rows later."""
    result = np.full(len(LAGS), np.nan)
    for k, lag in enumerate(LAGS):
        long = [e for e in residuals if len(e) > lag]
        if long:
            product = sum(float((e[lag:] * e[:-lag]).sum()) for e in long)
            squares = [sum(float((part**2).sum()) for part in parts) for parts in ([e[lag:] for e in long], [e[:-lag] for e in long])]
            result[k] = product / max(float(np.sqrt(squares[0] * squares[1])), 1e-12)
    return result
