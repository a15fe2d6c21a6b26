"""Power laws that errors follow over the factors of a study, with intervals.

``y = c_g x_1^a_1 x_2^a_2 ...`` by least squares of logarithms, with a constant ``c_g`` for every group ``g`` of rows that share a draw
(body, flight), so that a lucky draw moves no exponent. Intervals are Student's: residuals are taken as alike and independent.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Exponent:
    """An exponent with its 95% interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:+z.2f} ({self.low:+z.2f} to {self.high:+z.2f})"


def power_law(rows: pd.DataFrame, y: Array, factors: Sequence[str], group: str) -> tuple[tuple[Exponent, ...], float]:
    """Exponents of the columns ``factors``, and the standard deviation of ``ln y`` about the law.

    Parameters
    ----------
    rows
        Factors, all above zero, and the column ``group``.
    y
        (n,), any unit; rows where it is not a number above zero are left out.
    factors, group
        Names of columns.
    """
    good = np.isfinite(y) & (y > 0)
    x = np.log(rows.loc[good, list(factors)].to_numpy(dtype=np.float64))
    constants = pd.get_dummies(rows.loc[good, group]).to_numpy(dtype=np.float64)
    design, told = np.hstack([x, constants]), np.log(y[good])
    found, *_ = np.linalg.lstsq(design, told, rcond=None)
    free = len(told) - np.linalg.matrix_rank(design)
    if free < 1:
        return tuple(Exponent(float(value), float("nan"), float("nan")) for value in found[: len(factors)]), float("nan")
    variance = float(np.sum((told - design @ found) ** 2) / free)
    half = t.ppf(0.975, free) * np.sqrt(variance * np.diag(np.linalg.pinv(design.T @ design)))
    exponents = (Exponent(float(a), float(a - h), float(a + h)) for a, h in zip(found, half, strict=True))
    return tuple(exponents)[: len(factors)], float(np.sqrt(variance))
