"""Figures of a challenge: each with its number of cases, its interval, what was asked for, and whether it held."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import binomtest, bootstrap

Array = NDArray[np.float64]
RESAMPLES = 2000
HELD, MISSED, TOO_FEW, NOT_ASKED = "HELD", "MISSED", "TOO FEW CASES", "NOT ASKED FOR"


@dataclass(frozen=True)
class Figure:
    """One line of acceptance: ``value`` of ``n`` cases with its 95% interval, and the bound it is held to (at least or at most)."""

    line: str
    what: str
    value: float
    low: float
    high: float
    n: int
    least: float = -math.inf
    most: float = math.inf
    needed: int = 1
    unit: str = "%"

    @property
    def verdict(self) -> str:
        """Held, missed, too few cases to say, or not asked for."""
        if self.n < self.needed or not math.isfinite(self.value):
            return TOO_FEW
        if math.isinf(self.least) and math.isinf(self.most):
            return NOT_ASKED
        return HELD if self.least <= self.value <= self.most else MISSED


def share(line: str, what: str, hits: "pd.Series[bool]", **bounds: Any) -> Figure:
    """A share in percent with its exact interval [Clopper and Pearson 1934]."""
    n, k = len(hits), int(hits.sum())
    interval = binomtest(k, n).proportion_ci(method="exact") if n else None
    low, high = (100 * interval.low, 100 * interval.high) if interval else (math.nan, math.nan)
    return Figure(line, what, 100 * k / n if n else math.nan, low, high, n, **bounds)


def share_of_rows(line: str, what: str, hits: "pd.Series[bool]", cases: "pd.Series[str]", **bounds: Any) -> Figure:
    """A share in percent of rows of which several are of one case and depend on one another."""
    return of_rows(line, what, np.asarray(100.0 * hits.to_numpy(dtype=np.float64), dtype=np.float64), cases.tolist(), np.mean, **bounds)


def of_rows(line: str, what: str, values: Array, cases: Sequence[str], of: Callable[[Array], Any], **bounds: Any) -> Figure:
    """A mean or median of rows of which several are of one case: its interval is a bootstrap over cases [Davison and Hinkley 1997]."""
    grouped = pd.Series(values).groupby(list(cases)) if len(values) else ()
    rows = [part.to_numpy() for _, part in grouped]
    low = high = math.nan
    if len(rows) > 2 and np.ptp(values) > 0:
        drawn = np.random.default_rng(0).integers(len(rows), size=(RESAMPLES, len(rows)))
        low, high = np.quantile([of(np.concatenate([rows[i] for i in each])) for each in drawn], [0.025, 0.975]).tolist()
    return Figure(line, what, float(of(values)) if len(values) else math.nan, low, high, len(values), **bounds)


def typical(line: str, what: str, values: Array, of: Callable[..., Any], **bounds: Any) -> Figure:
    """A median or mean with its bootstrap interval [Efron and Tibshirani 1993]."""
    values = values[np.isfinite(values)]
    value = float(of(values)) if len(values) else math.nan
    low = high = math.nan
    if len(values) > 2 and np.ptp(values) > 0:
        interval = bootstrap((values,), of, n_resamples=RESAMPLES, method="percentile", rng=np.random.default_rng(0)).confidence_interval
        low, high = float(interval.low), float(interval.high)
    return Figure(line, what, value, low, high, len(values), **bounds)


def line_of(figure: Figure) -> str:
    """One printed line."""
    bounds = [
        f"at least {figure.least:g}" if math.isfinite(figure.least) else "",
        f"at most {figure.most:g}" if math.isfinite(figure.most) else "",
    ]
    asked = " and ".join(b for b in bounds if b) or "nothing"
    interval = f" ({figure.low:.3g} to {figure.high:.3g})" if math.isfinite(figure.low) else ""
    return f"{figure.line}. {figure.what}: {figure.value:.3g}{interval} {figure.unit}, n = {figure.n}; asked: {asked}: {figure.verdict}"


def figure_to_dict(figure: Figure) -> Mapping[str, Any]:
    """A figure with its verdict as plain values."""
    return {**asdict(figure), "verdict": figure.verdict}
