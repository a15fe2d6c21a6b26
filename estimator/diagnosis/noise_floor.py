"""Is there anything to explain at all? Residuals of a fitted campaign against noise that repeats.

What a model can be blamed for changes smoothly from frame to frame; a measurement's own noise does not. Half the mean square of the change
from one frame to the next is therefore noise whatever the model [von Neumann 1941, mean square successive difference]. The reduced
chi-square is the mean square of the residuals over that: 1 for noise alone, up to ``allowed`` where noise repeats over many frames. Each
kind of measurement makes its own floor (:mod:`estimator.measurements.silhouettes.noise_floor`,
:mod:`estimator.measurements.trajectories.noise_floor`).

Size alone is a blunt judge; whether the residuals' pattern is that of some effect is a sharp one (the score tests), so both are heard.

The interval is a bootstrap over sequences and, within them, over sightings [Davison and Hinkley 1997, section 3.8].
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.campaigns.campaign import Campaign, CampaignFit

Array = NDArray[np.float64]
DRAWS = 400
"""Of sequences and rows within them with replacement, for an interval of 95% [Davison and Hinkley 1997]."""
LAGS = np.array([1, 2, 3, 5, 8, 12, 20])
"""Rows apart at which autocorrelations are told: they decide nothing."""


@dataclass(frozen=True)
class NoiseFloor:
    """How large the residuals are and how large noise alone would be.

    ``rms_px`` of the residuals, ``repeated_px`` of the noise that changes with every frame, ``neighbours_px`` expected from neighbouring
    samples of the outlines; ``floor_px``: what no model can go below; ``jumps``: whether whole frames change by more than that.
    ``reduced`` chi-square with its 95% ``interval`` and the one ``allowed``; ``per_sequence`` (s,) each sequence's. ``lags`` (l,) frames
    and ``autocorrelation`` (l,) of the residuals in time with 95% ``autocorrelation_interval`` (2,) of the first;
    ``along_outline_rad``: turn of the tangent over which residuals are alike, ``expected_along_rad`` that of the noise.
    """

    rms_px: float
    repeated_px: float
    neighbours_px: float
    floor_px: float
    jumps: bool
    reduced: float
    interval: tuple[float, float]
    allowed: float
    per_sequence: Array
    lags: NDArray[np.int64]
    autocorrelation: Array
    autocorrelation_interval: tuple[float, float]
    along_outline_rad: float
    expected_along_rad: float

    @property
    def excess_px(self) -> float:
        """RMS (px) of what is left above noise and what is allowed beside it."""
        return float(np.sqrt(max(self.rms_px**2 - self.allowed * self.floor_px**2, 0.0)))

    @property
    def beyond(self) -> bool:
        """Whether residuals are larger than noise, by their size alone."""
        return self.interval[0] > self.allowed

    def explainable(self, p_missing: float, alpha: float) -> bool:
        """Whether there is something to explain: by size, by jumps, or because a candidate fits the pattern (``p_missing``, corrected)."""
        return self.beyond or self.jumps or p_missing < alpha


@dataclass(frozen=True)
class Sums:
    """Per sighting or row (n,): sums of squares, of half the squared changes to the next one and of products with it, and their numbers.

    ``square``, ``count``, ``change``, ``product``, ``pairs`` (n,).
    """

    square: Array
    count: Array
    change: Array
    product: Array
    pairs: Array


def floor_of(sums: Sequence[Sums], autocorrelation: Array, rng: np.random.Generator) -> NoiseFloor:
    """The floor where all noise is new in every row and has the size 1 otherwise; ``sums`` of every sequence.

    ``autocorrelation`` (7,) at the lags.
    """
    square, repeated, _ = _ratios(sums, [np.arange(len(s.square)) for s in sums])
    drawn = np.array([_ratios(*_resampled(sums, rng)) for _ in range(DRAWS)])
    return NoiseFloor(
        rms_px=float(np.sqrt(square)),
        repeated_px=float(np.sqrt(repeated)),
        neighbours_px=1.0,
        floor_px=float(np.sqrt(repeated)),
        jumps=False,
        reduced=square / max(repeated, 1e-12),
        interval=_interval(drawn[:, 0] / np.maximum(drawn[:, 1], 1e-12)),
        allowed=1.0,
        per_sequence=np.array([float(np.divide(*_ratios([s], [np.arange(len(s.square))])[:2])) for s in sums]),
        lags=LAGS,
        autocorrelation=autocorrelation,
        autocorrelation_interval=_interval(drawn[:, 2] / np.maximum(drawn[:, 0], 1e-12)),
        along_outline_rad=float("nan"),
        expected_along_rad=float("nan"),
    )


def _resampled(sums: Sequence[Sums], rng: np.random.Generator) -> tuple[list[Sums], list[NDArray[np.int64]]]:
    """Sequences drawn with replacement, and sightings or rows within them."""
    drawn = [sums[i] for i in rng.integers(0, len(sums), len(sums))]
    return drawn, [rng.integers(0, len(s.square), len(s.square)) for s in drawn]


def _ratios(sums: Sequence[Sums], rows: Sequence[NDArray[np.int64]]) -> tuple[float, float, float]:
    """Mean square, mean square of the noise, and mean product with the next row."""
    total = {name: sum(float(getattr(s, name)[r].sum()) for s, r in zip(sums, rows, strict=True)) for name in Sums.__annotations__}
    count, pairs = max(total["count"], 1.0), max(total["pairs"], 1.0)
    return total["square"] / count, total["change"] / pairs, total["product"] / pairs


def _interval(draws: Array) -> tuple[float, float]:
    """The middle 95% of draws (d,)."""
    low, high = np.quantile(draws, [0.025, 0.975])
    return float(low), float(high)


def noise_floor(campaign: Campaign, fit: CampaignFit, rng: np.random.Generator) -> NoiseFloor:
    """Judge the residuals of a fit as the campaign's kind of measurement does."""
    floor: NoiseFloor = campaign.kind.noise_floor(campaign, fit, rng)
    return floor
