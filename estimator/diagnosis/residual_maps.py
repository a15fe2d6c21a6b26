"""Where a model fails: maps of residuals over time, place, direction, speed and spin, and the axes that all kinds of measurement share.

What the mean residual in a bin is and how sure, each kind says (:mod:`estimator.measurements.silhouettes.residual_maps`,
:mod:`estimator.measurements.trajectories.residual_maps`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.campaigns.campaign import Campaign, CampaignFit

Array = NDArray[np.float64]
Index = NDArray[np.int64]
BINS, DIRECTIONS = 10, 12
"""Bins over a quantity, and over a turn. By judgement."""
SIGNIFICANT = 0.01
"""p-value, corrected for the number of maps, below which a map is said to show something (decision 47)."""


@dataclass(frozen=True)
class Axis:
    """One axis of maps.

    ``bin`` (r,) of every residual and ``centre`` (b,) of each bin in ``unit``, ``second`` (b,) its second coordinate; ``edges`` (b + 1,)
    where bins follow one another. ``displaces``: whether displacements make sense in a bin.
    """

    name: str
    title: str
    unit: str
    bin: Index
    centre: Array
    second: Array | None = None
    edges: Array | None = None
    displaces: bool = True


def even(name: str, title: str, unit: str, values: Array) -> Axis:
    """Bins of equal width over all values; ``values`` (r,) of the residuals."""
    low, high = float(values.min()), float(values.max())
    edges = np.linspace(low, high + 1e-9 * max(1.0, abs(high)), BINS + 1)
    number = np.clip(np.digitize(values, edges) - 1, 0, BINS - 1).astype(np.int64)
    return Axis(name, title, unit, number, np.asarray(0.5 * (edges[1:] + edges[:-1])), edges=np.asarray(edges))


def phase(degrees: Array) -> Axis:
    """Bins of the angle turned since the first frame; where that is less than a turn it says the same as time.

    ``degrees`` (r,) of the residuals.
    """
    whole = bool(degrees.max() >= 360.0)
    title = "angle turned, modulo one turn" if whole else "angle turned since the first frame"
    degrees = degrees % 360.0
    width = 360.0 / DIRECTIONS
    number = np.minimum((degrees / width).astype(np.int64), DIRECTIONS - 1)
    return Axis("spin_phase", title, "°", number, width * (np.arange(DIRECTIONS, dtype=np.float64) + 0.5))


@dataclass(frozen=True)
class ResidualMap:
    """One map: the component ``kind`` of the residual over one axis.

    ``centre`` (b,) middle of each bin in the axis's unit, ``second`` (b,) that of its second coordinate where it has one; ``mean_px`` and
    ``sigma_px`` (b,), ``count`` (b,) residuals; ``statistic`` Hotelling's F, ``p`` corrected for the number of maps; ``unit`` of what is
    mapped, if not px.
    ``bins`` (b,): numbers of the bins along the axis.
    """

    axis: Axis
    kind: str
    bins: Index
    mean_px: Array
    sigma_px: Array
    count: Index
    statistic: float
    p: float
    unit: str = "px"

    @property
    def centre(self) -> Array:
        """First coordinate of each bin."""
        return self.axis.centre[self.bins]

    @property
    def second(self) -> Array | None:
        """Second coordinate of each bin, if there is one."""
        return None if self.axis.second is None else self.axis.second[self.bins]

    @property
    def significant(self) -> bool:
        """Whether it shows something that noise does not."""
        return self.p < SIGNIFICANT


def residual_maps(campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
    """All maps of a fit, those that show most first, made as the campaign's kind of measurement makes them."""
    maps: tuple[ResidualMap, ...] = campaign.kind.residual_maps(campaign, fit)
    return maps


def shown(maps: Sequence[ResidualMap]) -> tuple[ResidualMap, ...]:
    """The best map of every axis, those that show most first."""
    best: dict[str, ResidualMap] = {}
    for each in maps:
        best.setdefault(each.axis.name, each)
    return tuple(best.values())
