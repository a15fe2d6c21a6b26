"""Median errors of points of a study with their intervals, beside what error bars predict and what the true body's bound allows.

A median is compared with a standard deviation through the median of the chi distribution: of an error with ``k`` equal components and
total standard deviation ``s`` (root of the summed variances) it is ``s sqrt(chi2.median(k) / k)``. With unequal components the true
factor lies between that and 0.67.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.stats import bootstrap, chi2

from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import INTERVAL_95
from studies.reporting.figures import RED, plain_logarithmic
from studies.reporting.words import number, table, with_interval

Array = NDArray[np.float64]

RESAMPLES = 4000
CONFIDENCE = 0.95
FEWEST = 6
"""Errors of which an interval is told: of five, not even the whole range holds the median in 95%."""


@dataclass(frozen=True)
class Quantity:
    """A velocity error: key in a score's columns, name for people, components, unit of what is told, ``per_si`` of it in one SI unit."""

    key: str
    title: str
    components: tuple[str, ...]
    unit: str
    per_si: float

    @property
    def column(self) -> str:
        """The column of the error in SI units."""
        return f"{self.key}_{'rads' if self.key == 'angular' else 'ms'}"

    @property
    def of(self) -> str:
        """The column of what a relative error refers to."""
        return "spin_rads" if self.key == "angular" else "speed_ms"

    @property
    def median_of_sigma(self) -> float:
        """The median error by the standard deviation."""
        return float(np.sqrt(chi2.median(len(self.components)) / len(self.components)))


QUANTITIES = (
    Quantity("in_plane", "in-plane v", COMPONENTS[:2], "mm/s", 1e3),
    Quantity("out_of_plane", "out-of-plane v", COMPONENTS[2:3], "mm/s", 1e3),
    Quantity("angular", "ω", COMPONENTS[3:], "rad/s", 1.0),
)


def errors(rows: pd.DataFrame, quantity: Quantity) -> Array:
    """Sizes (n,) of the errors, in the quantity's unit; NaN where nothing was measured."""
    return quantity.per_si * rows[quantity.column].to_numpy(dtype=np.float64)


def stated(rows: pd.DataFrame, quantity: Quantity) -> Array:
    """Total standard deviations (n,) that the estimates state, in the quantity's unit."""
    share = rows[f"sigma_{quantity.key}_percent"] / 100.0
    return quantity.per_si * (share * rows[quantity.of]).to_numpy(dtype=np.float64)


def bounds(rows: pd.DataFrame, quantity: Quantity) -> Array:
    """Total standard deviations (n,) of the true body's bound, in the quantity's unit; NaN where there is none."""
    columns = [f"true_bound_{c}" for c in quantity.components]
    if not set(columns) <= set(rows.columns):
        return np.full(len(rows), np.nan)
    return np.asarray(quantity.per_si * np.sqrt((rows[columns].to_numpy(dtype=np.float64) ** 2).sum(axis=1)))


def medians(rows: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """One row per point and quantity.

    Returns
    -------
    pandas.DataFrame
        ``by``, then ``quantity, n, measured, median, low, high, predicted, bound, coverage, pull``: ``low`` and ``high`` end the 95%
        bootstrap interval of the median, ``predicted`` and ``bound`` are median errors that stated standard deviations and the true
        body's bound imply, ``coverage`` is the share of components whose 95% interval holds the truth, ``pull`` the root mean square of
        errors over stated standard deviations.
    """
    told = []
    for point, group in rows.groupby(list(by), sort=True):
        for quantity in QUANTITIES:
            told.append({**dict(zip(by, point, strict=True)), **_of_point(group, quantity)})
    return pd.DataFrame(told)


def _of_point(group: pd.DataFrame, quantity: Quantity) -> dict[str, Any]:
    good = group[group["converged"]]
    found = errors(good, quantity)
    low, high = median_interval(found)
    pulls = good[[f"pull_{c}" for c in quantity.components]].to_numpy(dtype=np.float64)
    return {
        "quantity": quantity.key,
        "n": len(group),
        "measured": len(good),
        "median": _median(found),
        "low": low,
        "high": high,
        "predicted": _median(stated(good, quantity)) * quantity.median_of_sigma,
        "bound": _median(bounds(good, quantity)) * quantity.median_of_sigma,
        "coverage": float(np.mean(np.abs(pulls) <= INTERVAL_95)) if pulls.size else float("nan"),
        "pull": float(np.sqrt(np.mean(pulls**2))) if pulls.size else float("nan"),
    }


def median_interval(values: Array) -> tuple[float, float]:
    """The 95% bootstrap interval (percentiles) of the median of values (n,) of any unit; NaN with too few of them."""
    if len(values) < FEWEST:
        return float("nan"), float("nan")
    rng = np.random.default_rng(0)
    found = bootstrap((values,), np.median, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile", rng=rng)
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def _median(values: Array) -> float:
    return float(np.median(values)) if len(values) else float("nan")


@dataclass(frozen=True)
class Line:
    """One line of medians: column of the horizontal axis, colour, label, and how far its dots are moved by a factor."""

    column: str
    colour: str
    label: str
    style: str = "-"
    moved: float = 1.0


def lay_axes(axes: Axes, label: str, quantity: Quantity, values: Sequence[float]) -> None:
    """Logarithmic axes of a quantity against what ``label`` says, marked at its ``values``."""
    axes.set(xscale="log", xlabel=label)
    axes.set_title(f"{quantity.title} ({quantity.unit})")
    axes.set_xticks(values, [f"{value:g}" for value in values])
    axes.set_xticks([], minor=True)
    plain_logarithmic(axes)


def draw_medians(axes: Axes, points: pd.DataFrame, line: Line, *, accompanied: bool = False) -> None:
    """Medians with intervals; crosses at the foot: nothing was measured. ``accompanied`` by what error bars and bound say."""
    x = points[line.column].to_numpy(dtype=np.float64) * line.moved
    median, low, high = (points[key].to_numpy(dtype=np.float64) for key in ("median", "low", "high"))
    spread = np.vstack([median - low, high - median])
    axes.errorbar(x, median, yerr=spread, fmt=f"o{line.style}", ms=4, lw=1.4, capsize=2.5, color=line.colour, label=line.label)
    lost = x[np.isnan(median)]
    if lost.size:
        foot: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "color": RED, "clip_on": False}
        axes.plot(lost, np.full(lost.size, 0.05), "x", ms=7, mew=1.8, label="no measurement", **foot)
    if accompanied:
        axes.plot(x, points["predicted"], "--", lw=1.2, color="0.25", label="predicted by the error bars")
        axes.plot(x, points["bound"], ":", lw=1.4, color="0.5", label="bound of the true body")


def median_table(points: pd.DataFrame, columns: Sequence[tuple[str, str]]) -> list[str]:
    """Lines of a Markdown table: one row per point, medians with intervals; ``columns`` are (column, heading)."""
    heads = [*(heading for _, heading in columns), "measured", *(f"{q.title} ({q.unit})" for q in QUANTITIES)]
    cells = []
    for point, group in points.groupby([column for column, _ in columns], sort=True):
        by = group.set_index("quantity")
        count = f"{by['measured'].iloc[0]} of {by['n'].iloc[0]}"
        cells.append([*(number(value) for value in point), count, *(with_interval(by.loc[q.key].to_dict()) for q in QUANTITIES)])
    return table(heads, cells)


def held_in_words(rows: pd.DataFrame) -> str:
    """A sentence on the 95% intervals of all rows."""
    good = rows[rows["converged"]]
    parts = []
    for title, components in (("v", COMPONENTS[:3]), ("ω", COMPONENTS[3:])):
        pulls = good[[f"pull_{c}" for c in components]].to_numpy(dtype=np.float64)
        held, size = np.mean(np.abs(pulls) <= INTERVAL_95), np.sqrt(np.mean(pulls**2))
        parts.append(f"{100 * held:.1f}% of the components of {title} (root mean square of pulls {number(size)})")
    return f"Over the whole study the stated 95% intervals hold the truth for {' and '.join(parts)}."


def lost_in_words(rows: pd.DataFrame) -> str:
    """A sentence that says how many flights ended without a measurement, by status."""
    lost = rows[~rows["converged"]]
    if lost.empty:
        return f"All {len(rows)} measurements converged."
    counts = ", ".join(f"{n} *{status}*" for status, n in lost["status"].value_counts().items())
    return f"Of {len(rows)} measurements {len(lost)} are none, with a status that says so: {counts}."
