"""Tables of scores: aggregates with coverage, and each poor sequence with its cause."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pandas as pd

from datasets.estimate import Status
from datasets.scoring.metrics import COMPONENTS, INSTANTS, METRICS, Metric, metric
from datasets.scoring.score import VECTORS, Row

IRREGULARITY_BINS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, float("inf"))
"""Each bin holds its lower edge."""
WRONG_MINIMUM_DEG = 5.0
EXPLAINED_SIGMAS = 3.0
"""An error of fewer of the sequence's own standard deviations is what its error bar says."""
CHECKED = ("middle_in_plane_percent", "middle_angular_percent")
"""The metrics that decide whether a sequence is a poor one."""


def score_table(rows: Sequence[Row]) -> pd.DataFrame:
    """One row per sequence, sorted by name, so that the order of work does not show."""
    return pd.DataFrame(list(rows)).sort_values("sequence", kind="stable", ignore_index=True)


def aggregate(table: pd.DataFrame, by: str | None = None) -> pd.DataFrame:
    """Per group and metric: median, 5th and 95th percentile, share inside the tolerance, coverage of the 95% intervals, counts.

    Parameters
    ----------
    table
        As from :func:`score_table`.
    by
        A column to group by (``n_frames``, ``n_views``, ``particle``, ``irregularity``: the last in bins), or ``None``: all together.

    Returns
    -------
    pandas.DataFrame
        Columns ``group, metric, unit, median, p05, p95, inside_tolerance, coverage, n, n_converged``. ``inside_tolerance`` is the
        share of *all* sequences of the group: one that did not converge is not inside. Percentiles and coverage are those of the
        ``n_converged`` alone, so an estimator that gives up on hard sequences improves them; read them beside ``inside_tolerance``.
    """
    rows = [_summary(str(name), group, entry) for name, group in _groups(table, by) for entry in METRICS]
    return pd.DataFrame(rows)


def status_counts(table: pd.DataFrame, by: str | None = None) -> pd.DataFrame:
    """How many sequences ended in which status, per group; columns ``group, status, n``."""
    rows = [
        {"group": str(name), "status": status, "n": int(count)}
        for name, group in _groups(table, by)
        for status, count in sorted(group["status"].value_counts().items())
    ]
    return pd.DataFrame(rows, columns=["group", "status", "n"])


def coverage(table: pd.DataFrame) -> pd.DataFrame:
    """Per instant and component: share of 95% intervals that hold the truth, spread of the pulls, RMSE by the bound, count."""
    scored = table[table["converged"]]
    rows = [
        {
            "instant": instant,
            "component": name,
            "coverage": float(scored[f"{instant}_inside95_{name}"].mean()),
            "pull_rms": _rms(scored[f"{instant}_pull_{name}"]),
            "rmse_over_bound": _rms(scored[f"{instant}_over_bound_{name}"]),
            "n": len(scored),
        }
        for instant in INSTANTS
        for name in COMPONENTS
    ]
    return pd.DataFrame(rows)


def ellipsoid_coverage(table: pd.DataFrame) -> pd.DataFrame:
    """Per instant: share of whole 95% ellipsoids of v and of omega that hold the truth; columns ``instant, vector, coverage, n``."""
    scored = table[table["converged"]]
    rows = [
        {"instant": instant, "vector": name, "coverage": float(scored[f"{instant}_ellipsoid95_{name}"].mean()), "n": len(scored)}
        for instant in INSTANTS
        for name in VECTORS
    ]
    return pd.DataFrame(rows)


def worse_sequences(table: pd.DataFrame) -> pd.DataFrame:
    """Each sequence outside 0.5% in plane or 1% in angular velocity (mid-sequence), or without a measurement, and its cause.

    Causes, in this order:

    * the status, where it is not converged (``ambiguous``...);
    * the orientation is more than 5 degrees off: ``ambiguous`` for a body with symmetries, otherwise ``wrong minimum``;
    * ``model misses something``: the estimate says of itself that its residuals are not noise (column ``misfit``), as wide as it may be;
    * ``slow``: in every metric that is outside, the error is within three of the sequence's own estimated standard deviations, and one of
      them by the speed (spin) already exceeds the tolerance: the precision reached is the limit, and a faster flight would be inside;
    * ``noise or model``: neither; an unlucky draw of the noise, or something that the model leaves out.

    Columns ``sequence, particle, cause, in_plane_percent, angular_percent, sigma_in_plane_percent, sigma_angular_percent, speed_ms,
    spin_rads, orientation_deg``.
    """
    poor = table[[_is_poor(row) for _, row in table.iterrows()]]
    columns = {
        "sequence": poor["sequence"],
        "particle": poor["particle"],
        "cause": [_cause(row) for _, row in poor.iterrows()],
        "in_plane_percent": poor["middle_in_plane_percent"],
        "angular_percent": poor["middle_angular_percent"],
        "sigma_in_plane_percent": poor["middle_sigma_in_plane_percent"],
        "sigma_angular_percent": poor["middle_sigma_angular_percent"],
        "speed_ms": poor["speed_ms"],
        "spin_rads": poor["spin_rads"],
        "orientation_deg": poor["orientation_median_deg"],
    }
    return pd.DataFrame(columns).reset_index(drop=True)


def _groups(table: pd.DataFrame, by: str | None) -> list[tuple[object, pd.DataFrame]]:
    if by is None:
        return [("all", table)]
    if by == "irregularity":
        names = [f"{low:g}-{high:g}" for low, high in pairwise(IRREGULARITY_BINS)]
        labels = pd.cut(table["irregularity"].clip(lower=0), IRREGULARITY_BINS, right=False, labels=names)
        return list(table.groupby(labels, observed=True))
    return list(table.groupby(by, sort=True))


def _summary(name: str, group: pd.DataFrame, entry: Metric) -> Row:
    values = group[entry.key].dropna().to_numpy(dtype=np.float64)
    low, median, high = np.percentile(values, [5, 50, 95], method="inverted_cdf") if len(values) else (np.nan,) * 3
    inside = values <= entry.tolerance if entry.direction == "lower" else values >= entry.tolerance
    return {
        "group": name,
        "metric": entry.key,
        "unit": entry.unit,
        "median": float(np.median(values)) if len(values) else float(median),
        "p05": float(low),
        "p95": float(high),
        "inside_tolerance": float(inside.sum() / len(group)) if len(group) else float("nan"),
        "coverage": _coverage_behind(group, entry),
        "n": len(group),
        "n_converged": int(group["converged"].sum()),
    }


def _coverage_behind(group: pd.DataFrame, entry: Metric) -> float:
    """Share of the 95% intervals of the metric's components that hold the truth."""
    if not entry.components:
        return float("nan")
    instant = entry.key.split("_", 1)[0]
    flags = group[[f"{instant}_inside95_{name}" for name in entry.components]].to_numpy(dtype=np.float64)
    return float(np.nanmean(flags)) if np.isfinite(flags).any() else float("nan")


def _rms(values: pd.Series) -> float:
    squares = np.square(values.to_numpy(dtype=np.float64))
    return float(np.sqrt(squares.mean())) if len(squares) else float("nan")


def _is_poor(row: pd.Series) -> bool:
    return not row["converged"] or any(not row[key] <= metric(key).tolerance for key in CHECKED)


def _cause(row: pd.Series) -> str:
    if row["status"] != Status.CONVERGED.value:
        return str(row["status"])
    if row["orientation_median_deg"] > WRONG_MINIMUM_DEG:
        return Status.AMBIGUOUS.value if row["n_symmetries"] > 1 else "wrong minimum"
    if row.get("misfit", False):
        return "model misses something"
    outside = [key for key in CHECKED if not row[key] <= metric(key).tolerance]
    return "slow" if all(_limited_by_precision(row, key) for key in outside) else "noise or model"


def _limited_by_precision(row: pd.Series, key: str) -> bool:
    sigma = row[key.replace("middle_", "middle_sigma_")]
    return bool(row[key] <= EXPLAINED_SIGMAS * sigma and sigma > metric(key).tolerance)
