"""How near errors come to the Cramér-Rao bound of the true body, which the truth of a free flight in outlines states.

A ratio of 1 is what nobody beats without a bias. The bound is that of whoever knows the body, so that an instrument that learns it from
views stays above 1. Whoever makes a sequence computes it; the ``bound`` of an estimate is another one, the instrument's own.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from datasets.scoring.metrics import COMPONENTS
from datasets.truth import MotionBound

Array = NDArray[np.float64]
Row = dict[str, Any]


@dataclass(frozen=True)
class Quantity:
    """Components that are of one kind; ``unit`` of what is printed, and how many of it are one SI unit."""

    name: str
    unit: str
    components: tuple[str, ...]
    per_si: float


QUANTITIES = (
    Quantity("in-plane v", "mm/s", ("vx", "vy"), 1e3),
    Quantity("depth v", "mm/s", ("vz",), 1e3),
    Quantity("omega", "rad/s", ("wx", "wy", "wz"), 1.0),
)


def against_bound(error: Array | None, bound: MotionBound) -> Row:
    """The bound's standard deviations (SI) at mid-sequence, and the sizes of an error (6,) of v and omega over them.

    ``error`` ``None``: nothing was measured.
    """
    sigma = np.sqrt(np.diag(bound.covariance))
    over = np.full(6, np.nan) if error is None else np.abs(error) / sigma
    row: Row = {f"middle_true_bound_{name}": float(value) for name, value in zip(COMPONENTS, sigma, strict=True)}
    return row | {f"middle_over_true_bound_{name}": float(value) for name, value in zip(COMPONENTS, over, strict=True)}


def efficiency(table: pd.DataFrame) -> pd.DataFrame:
    """Per quantity: the root mean square of one component's errors at mid-sequence by that of its bound.

    Parameters
    ----------
    table
        Rows of :func:`datasets.scoring.score.score`; those that did not converge or have no bound are left out.

    Returns
    -------
    pandas.DataFrame
        Columns ``quantity, unit, rmse, rms_bound, rmse_over_bound, rms_of_ratios, n``. ``rms_of_ratios`` takes every error over its own
        bound first, so that sequences of large bounds do not decide it; ``n`` sequences. No rows where no sequence has a bound.
    """
    if "middle_true_bound_vx" not in table:
        return pd.DataFrame([])
    measured = table[table["converged"] & table["middle_true_bound_vx"].notna()]
    return pd.DataFrame([_of(quantity, measured) for quantity in QUANTITIES] if len(measured) else [])


def _of(quantity: Quantity, rows: pd.DataFrame) -> Row:
    bound = rows[[f"middle_true_bound_{name}" for name in quantity.components]].to_numpy(dtype=np.float64)
    over = rows[[f"middle_over_true_bound_{name}" for name in quantity.components]].to_numpy(dtype=np.float64)
    rmse, rms_bound = (quantity.per_si * float(np.sqrt(np.mean(values**2))) for values in (over * bound, bound))
    return {
        "quantity": quantity.name,
        "unit": quantity.unit,
        "rmse": rmse,
        "rms_bound": rms_bound,
        "rmse_over_bound": rmse / rms_bound,
        "rms_of_ratios": float(np.sqrt(np.mean(over**2))),
        "n": len(rows),
    }
