"""Medians of the studies with their intervals, beside what the error bars predict and what the bound allows.

A median is compared with a standard deviation through the median of the chi distribution: of an error with ``k`` equal components and
total standard deviation ``s`` (root of the summed variances) it is ``s sqrt(chi2.median(k) / k)``. With unequal components the true
factor lies between that and 0.67.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import bootstrap, chi2

from datasets.scoring.metrics import COMPONENTS, metric

RESAMPLES = 4000
CONFIDENCE = 0.95
POOR_COVERAGE = 0.75
"""Well below 95% even for the few sequences of a small study."""


@dataclass(frozen=True)
class Quantity:
    """A velocity error: column in the score, name for people, components, column and unit of the error that is not relative."""

    key: str
    title: str
    components: tuple[str, ...]
    absolute: str
    absolute_unit: str
    absolute_scale: float

    @property
    def median_of_sigma(self) -> float:
        """The median error by the standard deviation."""
        return float(np.sqrt(chi2.median(len(self.components)) / len(self.components)))

    @property
    def tolerance_percent(self) -> float:
        """The error that a good sequence may have."""
        return metric(f"middle_{self.key}_percent").tolerance


QUANTITIES = (
    Quantity("in_plane", "in-plane velocity", COMPONENTS[:2], "in_plane_ms", "mm/s", 1e3),
    Quantity("out_of_plane", "out-of-plane velocity", COMPONENTS[2:3], "out_of_plane_ms", "mm/s", 1e3),
    Quantity("angular", "angular velocity", COMPONENTS[3:], "angular_rads", "rad/s", 1.0),
)


def summary(table: pd.DataFrame, by: Sequence[str], *, absolute: bool = False) -> pd.DataFrame:
    """One row per point and quantity: median error of the converged sequences and its bootstrap interval.

    Parameters
    ----------
    table
        As from :func:`scripts.study_runs.run_cases`.
    by
        Columns that name a point.
    absolute
        Errors in mm/s and rad/s instead of per cent of the speed and of the spin.

    Returns
    -------
    pandas.DataFrame
        ``by``, then ``quantity, unit, n, n_converged, median, low, high, predicted, bound, coverage``: ``predicted`` and ``bound`` are
        median errors that the reported standard deviations and the bound imply, ``coverage`` the share of 95% intervals of the
        components that hold the truth.
    """
    rows = []
    for point, group in table.groupby(list(by), sort=True):
        for quantity in QUANTITIES:
            rows.append({**dict(zip(by, point, strict=True)), **_summary(group, quantity, absolute)})
    return pd.DataFrame(rows)


def _summary(group: pd.DataFrame, quantity: Quantity, absolute: bool) -> dict[str, Any]:
    good = group[group["converged"]]
    scale = good["spin_rads" if quantity.key == "angular" else "speed_ms"] * quantity.absolute_scale / 100 if absolute else 1.0
    errors = (good[f"{quantity.key}_percent"] * scale).to_numpy(dtype=np.float64)
    low, high = median_interval(errors)
    inside = good[[f"inside95_{component}" for component in quantity.components]].to_numpy(dtype=np.float64)
    return {
        "quantity": quantity.key,
        "unit": quantity.absolute_unit if absolute else "%",
        "n": len(group),
        "n_converged": len(good),
        "median": _median(errors),
        "low": low,
        "high": high,
        "predicted": _median(good[f"sigma_{quantity.key}_percent"] * scale) * quantity.median_of_sigma,
        "bound": _median(good[f"bound_{quantity.key}_percent"] * scale) * quantity.median_of_sigma,
        "coverage": float(inside.mean()) if inside.size else float("nan"),
    }


def median_interval(errors: np.ndarray) -> tuple[float, float]:
    """The 95% bootstrap interval (percentiles) of the median; NaN with fewer than three values."""
    if len(errors) < 3:
        return float("nan"), float("nan")
    rng = np.random.default_rng(0)
    found = bootstrap((errors,), np.median, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile", rng=rng)
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def _median(values: Any) -> float:
    return float(np.median(values)) if len(values) else float("nan")


def inside_in_words(points: pd.DataFrame, column: str, quantity: Quantity, unit: str) -> str:
    """At which values of ``column`` the median is inside the tolerance; where nothing was measured it is not."""
    mine = points[points["quantity"] == quantity.key].sort_values(column)
    inside = (mine["median"] <= quantity.tolerance_percent).to_numpy()
    values = [f"{value:g}" for value in mine[column]]
    if inside.all() or not inside.any():
        return "everywhere" if inside.all() else "nowhere"
    first, last, n = int(np.argmax(inside)), len(inside) - 1 - int(np.argmax(inside[::-1])), int(inside.sum())
    if last == len(inside) - 1 and n == len(inside) - first:
        return f"from {values[first]} {unit} on"
    if first == 0 and n == last + 1:
        return f"up to {values[last]} {unit}"
    return "at " + ", ".join(value for value, good in zip(values, inside, strict=True) if good) + f" {unit}"


def overconfident(points: pd.DataFrame) -> pd.DataFrame:
    """The points whose 95% intervals hold the truth for less than ``POOR_COVERAGE`` of the components, worst first."""
    return points[points["coverage"] < POOR_COVERAGE].sort_values(["coverage", "predicted"], kind="stable")
