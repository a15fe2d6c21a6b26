"""Instruments beside one another on the same sequences, cell by cell: who is first, and whether that is decided.

A cell is a set of sequences. An instrument stands in it by the median of its errors over *all* of them: a sequence without a measurement
counts as infinitely wrong, so that nobody gains by giving up. Whether the first of a cell is ahead of the second is told by the mean
ratio of their errors, sequence by sequence (:mod:`datasets.scoring.paired`), cut at ``FARTHEST``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.scoring.metrics import METRICS, Metric
from datasets.scoring.paired import log_ratios, paired
from datasets.scoring.score import Row

Array = NDArray[np.float64]
RESAMPLES = 2000
LEVEL = 0.95
FARTHEST = 100.0
"""Ratio of errors from which how much larger they are says nothing more: one of the two did not measure."""
LEAST = 6
"""Sequences below which nothing is decided: of two or three of two equal instruments that fail at half of them, 13 to 16% would be."""
JUDGED = tuple(entry for entry in METRICS if entry.key.startswith("middle_") and entry.unit == "%")
"""Errors of v in and out of the picture's plane and of omega, in % of the true speed and spin, at mid-sequence."""


@dataclass(frozen=True)
class Standing:
    """An instrument in one cell by one metric.

    ``median`` over all ``n`` sequences (infinite where fewer than half are measured), with its 95% interval ``low`` to ``high``; of the
    ``measured`` ones the share ``inside_95`` of 95% intervals that hold the truth (NaN without any).
    """

    cell: str
    metric: str
    instrument: str
    median: float
    low: float
    high: float
    inside_95: float
    measured: int
    n: int


@dataclass(frozen=True)
class First:
    """Who is first in a cell by one metric: by what factor (``ratio``, 95% interval ``low`` to ``high``) errors of ``second`` are larger.

    ``lost``: the sequences in which ``second`` is nearer to the truth, worst first. Nobody is first where nobody measures half of a cell.
    """

    cell: str
    metric: str
    first: str
    second: str
    ratio: float
    low: float
    high: float
    lost: tuple[str, ...]

    @property
    def decided(self) -> bool:
        """Whether the interval of the factor lies above one; one below it contradicts the medians, and decides nothing for the first."""
        return self.low > 1


@dataclass(frozen=True)
class Leaderboard:
    """All standings, best first in every cell and metric, and who is first."""

    standings: tuple[Standing, ...]
    firsts: tuple[First, ...]

    def entries(self) -> dict[str, list[dict[str, Any]]]:
        """As plain values."""
        return {
            "standings": [asdict(standing) for standing in self.standings],
            "firsts": [{**asdict(first), "decided": first.decided} for first in self.firsts],
        }


def leaderboard(cells: Mapping[str, Mapping[str, Sequence[Row]]], rng: np.random.Generator) -> Leaderboard:
    """Where instruments stand.

    Parameters
    ----------
    cells
        For each cell, for each instrument the rows of :func:`datasets.scoring.score.score`, one per sequence, the same sequences for all.
    rng
        Draws the bootstrap's samples.
    """
    standings: list[Standing] = []
    firsts: list[First] = []
    for cell, instruments in cells.items():
        tables = {name: pd.DataFrame(list(rows)).set_index("sequence").sort_index() for name, rows in instruments.items()}
        for entry in JUDGED:
            ranked = sorted((_standing(cell, name, table, entry, rng) for name, table in tables.items()), key=lambda one: one.median)
            standings += ranked
            if len(ranked) > 1 and np.isfinite(ranked[0].median):
                firsts.append(_first(cell, entry, [(one.instrument, tables[one.instrument]) for one in ranked[:2]]))
    return Leaderboard(tuple(standings), tuple(firsts))


def _errors(table: pd.DataFrame, entry: Metric) -> Array:
    errors: Array = np.array(table[entry.key].astype(float).where(table["converged"], np.inf).fillna(np.inf), dtype=np.float64)
    return errors


def _standing(cell: str, name: str, table: pd.DataFrame, entry: Metric, rng: np.random.Generator) -> Standing:
    errors = _errors(table, entry)
    low, high = _interval(errors, rng)
    scored = table[table["converged"]]
    flags = scored[[f"middle_inside95_{component}" for component in entry.components]].to_numpy(dtype=np.float64)
    return Standing(
        cell=cell,
        metric=entry.key,
        instrument=name,
        median=_median(errors),
        low=low,
        high=high,
        inside_95=float(flags.mean()) if len(flags) else float("nan"),
        measured=len(scored),
        n=len(table),
    )


def _first(cell: str, entry: Metric, two: list[tuple[str, pd.DataFrame]]) -> First:
    (first, best), (second, next_best) = two
    errors = (np.where(np.isfinite(found), found, np.nan) for found in (_errors(best, entry), _errors(next_best, entry)))
    found = paired(log_ratios(*errors), cut=FARTHEST, level=(1 - LEVEL) / 2)
    lost = [str(best.index[k]) for k in np.argsort(found.log_ratios) if found.log_ratios[k] < 0]
    low, high = (found.low, found.high) if found.n >= LEAST else (0.0, float("inf"))
    return First(cell, entry.key, first, second, found.ratio, low, high, tuple(lost))


def _median(values: Array) -> float:
    """The median; infinite where half of the values are."""
    low, high = np.sort(values)[[(len(values) - 1) // 2, len(values) // 2]]
    return float(high) if np.isinf(high) else float(0.5 * (low + high))


def _interval(values: Float[NDArray[np.float64], " n"], rng: np.random.Generator) -> tuple[float, float]:
    draws = np.array([_median(values[rows]) for rows in rng.integers(0, len(values), (RESAMPLES, len(values)))])
    low, high = np.quantile(draws, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], method="inverted_cdf")
    return float(low), float(high)
