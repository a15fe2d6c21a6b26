"""How often an effect is found against its size: ``P(found) = Phi((ln r - m) / s)``, r the size over the 95% limit of the table.

``s`` is common to all effects, ``m`` each one's own [Finney, Probit Analysis (1971)]; a weak prior keeps ``m`` finite where everything or
nothing was found. Where no effect was hidden far enough below its limit, the size found in half of the cases is an upper bound.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import norm

Array = NDArray[np.float64]
PRIOR = 1.5
"""Standard deviation of the prior of ``m`` about 0 and of ``ln s`` about ln 0.4."""
TYPICAL_WIDTH = 0.4
Z95 = 1.645


def detection_table(cases: pd.DataFrame) -> pd.DataFrame:
    """Per effect: cases, share found, and the sizes found in half and in 95% of cases with 95% intervals, in units of the limit."""
    singles = cases[(cases["kind"] == "single") & (cases["ratio"] > 0)]
    if singles.empty:
        return pd.DataFrame()
    x, y = np.log(singles["ratio"].to_numpy(dtype=np.float64)), singles["all_found"].to_numpy(dtype=np.float64)
    of = {key: (singles["hidden"] == key).to_numpy() for key in sorted(singles["hidden"].unique())}
    width = _common_width([(x[rows], y[rows]) for rows in of.values()])
    rows = [{"effect": "all", **_row(x, y, _fitted(x, y, None)[1])}]  # all together are spread by their middles, too
    return pd.DataFrame([*rows, *({"effect": key, **_row(x[own], y[own], width)} for key, own in of.items())])


def _common_width(groups: Sequence[tuple[Array, Array]]) -> float:
    """The width with which all groups, each about a middle of its own, are likeliest; its prior counts once."""

    def cost(log_width: float) -> float:
        width = float(np.exp(log_width))
        each = sum(_cost(x, y, _fitted(x, y, width)[0], width) for x, y in groups)
        return each - (len(groups) - 1) * _prior_of(width)

    found = minimize_scalar(cost, bounds=(np.log(0.02), np.log(4.0)), method="bounded", options={"xatol": 0.01})
    return float(np.exp(found.x))


def _row(x: Array, y: Array, width: float) -> dict[str, Any]:
    middle, _ = _fitted(x, y, width)
    low, high = _interval(x, y, middle, width)
    factor = np.exp(Z95 * width)
    return {
        "cases": len(x),
        "found": int(y.sum()),
        "half": float(np.exp(middle)),
        "half_low": float(np.exp(low)),
        "half_high": float(np.exp(high)),
        "in_95_percent": float(np.exp(middle) * factor),
        "in_95_percent_low": float(np.exp(low) * factor),
        "in_95_percent_high": float(np.exp(high) * factor),
    }


def _cost(x: Array, y: Array, middle: float, width: float) -> float:
    z = (x - middle) / width
    likelihood = y @ norm.logcdf(z) + (1.0 - y) @ norm.logcdf(-z)
    return float(-likelihood + 0.5 * (middle / PRIOR) ** 2 + _prior_of(width))


def _prior_of(width: float) -> float:
    return float(0.5 * (np.log(width / TYPICAL_WIDTH) / PRIOR) ** 2)


def _fitted(x: Array, y: Array, width: float | None) -> tuple[float, float]:
    if width is not None:
        grid = np.linspace(-4.0, 4.0, 401)
        return float(grid[np.argmin([_cost(x, y, m, width) for m in grid])]), width

    def cost(at: Array) -> float:
        return _cost(x, y, float(at[0]), float(np.exp(at[1])))

    found = minimize(cost, np.array([0.0, np.log(TYPICAL_WIDTH)]), method="Nelder-Mead")
    return float(found.x[0]), float(np.exp(found.x[1]))


def _interval(x: Array, y: Array, middle: float, width: float) -> tuple[float, float]:
    """Values of ``m`` whose likelihood is within 1.92 of the best one's [Wilks 1938]."""
    best = _cost(x, y, middle, width)
    grid = np.linspace(-6.0, 6.0, 2401)
    inside = grid[np.array([_cost(x, y, m, width) for m in grid]) <= best + 1.92]
    return float(inside.min()), float(inside.max())
