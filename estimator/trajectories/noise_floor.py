"""Is there anything to explain in a campaign of trajectories? Residuals against what changes from row to row.

As for silhouettes, half the mean square of the change from one row to the next is noise whatever the model [von Neumann 1941]; where noise
of neighbouring rows is alike by ``rho``, that is ``1 - rho`` of its variance. Residuals are in standard deviations of each channel's noise.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.noise_floor import DRAWS, LAGS, NoiseFloor, Sums, interval_of, resampled
from estimator.fitting.campaign import Campaign, CampaignFit

Array = NDArray[np.float64]


def trajectory_floor(campaign: Campaign, fit: CampaignFit, rng: np.random.Generator) -> NoiseFloor:
    """Judge the residuals of a fit, in standard deviations of the noise; rows that jump are what that is measured by."""
    both = zip(campaign.sequences, fit.equations, strict=True)
    sums = [_sums(each.errors.e, each.errors.seen, task.repeats) for task, each in both]
    square, floor, _ = _ratios(sums, [np.arange(len(s.square)) for s in sums])
    drawn = np.array([_ratios(*resampled(sums, rng)) for _ in range(DRAWS)])
    return NoiseFloor(
        rms_px=float(np.sqrt(square)),
        repeated_px=float(np.sqrt(floor)),
        neighbours_px=1.0,
        floor_px=float(np.sqrt(floor)),
        jumps=False,
        reduced=square / max(floor, 1e-12),
        interval=interval_of(drawn[:, 0] / np.maximum(drawn[:, 1], 1e-12)),
        allowed=1.0,
        per_sequence=np.array([float(np.divide(*_ratios([s], [np.arange(len(s.square))])[:2])) for s in sums]),
        lags=LAGS,
        autocorrelation=_autocorrelation([each.errors.e for each in fit.equations]),
        autocorrelation_interval=interval_of(drawn[:, 2] / np.maximum(drawn[:, 0], 1e-12)),
        along_outline_rad=float("nan"),
        expected_along_rad=float("nan"),
    )


def _sums(e: Array, seen: NDArray[np.bool_], repeats: Array) -> Sums:
    """Squared changes are over what they are of the noise."""
    rho = (repeats - 1.0) / (repeats + 1.0)
    both = np.vstack([seen[1:] & seen[:-1], np.zeros((1, e.shape[1]), dtype=np.bool_)])
    following = np.vstack([e[1:], np.zeros((1, e.shape[1]))])
    change = np.where(both, 0.5 * (following - e) ** 2 / (1.0 - rho), 0.0).sum(axis=1)
    product = np.where(both, following * e, 0.0).sum(axis=1)
    return Sums((e**2).sum(axis=1), seen.sum(axis=1).astype(np.float64), change, product, both.sum(axis=1).astype(np.float64))


def _ratios(sums: Sequence[Sums], rows: Sequence[NDArray[np.int64]]) -> tuple[float, float, float]:
    """Mean square, mean square of the noise, and mean product with the next row."""
    total = {name: sum(float(getattr(s, name)[r].sum()) for s, r in zip(sums, rows, strict=True)) for name in Sums.__annotations__}
    count, pairs = max(total["count"], 1.0), max(total["pairs"], 1.0)
    return total["square"] / count, total["change"] / pairs, total["product"] / pairs


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
