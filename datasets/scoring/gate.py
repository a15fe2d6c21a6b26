"""The regression gate: whether an estimator run is worse than the committed baseline, sequence by sequence.

Runs are paired by sequence, so that what is hard about a sequence cancels. For every gated metric the median of the paired differences
(candidate minus baseline, signed so that positive is worse) gets a 99% bootstrap interval [Efron, Tibshirani 1993, ch. 13]. The run is
worse when

* the whole interval lies beyond the metric's tolerance, or
* a sequence that converged in the baseline does not converge any more, or
* single sequences jump: at least ``JUMP`` times their baseline (and the baseline's median), and further than the scatter of the
  other differences explains (``SCATTER`` robust standard deviations) and than the tolerance.

A metric whose differences are all zero is never worse. The tolerance is stored in the baseline, in the metric's unit; where the
baseline was written it was a tenth of the metric's median, so that it fits easy and hard benchmarks alike. Measured on simulated errors
of very unequal sequences (100 trials, 12 sequences): an alarm for errors 1.2 times as large in 100%, for a bias of one standard
deviation in 99%, for a third of fresh noise in 1%, for a wholly independent realisation of the noise in 8%. With six sequences the
power falls to 98% and 77%, and false alarms rise to 7% and 10%.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.json_documents import Document, read_document, revived, write_document
from datasets.scoring.metrics import METRICS, metric

Array = NDArray[np.float64]
Row = Mapping[str, Any]

TOLERATED_SHARE = 0.1
"""Worsening of a median, as a share of the baseline's, that is not worth an alarm."""
JUMP = 6.0
SCATTER = 10.0
LEVEL = 0.99
"""Of the intervals; with eight metrics a 95% interval would raise a false alarm too often."""
RESAMPLES = 2000
NAMED = 5
"""How many sequences a sentence names at most."""


@dataclass(frozen=True)
class Tolerance:
    """What the baseline says about one metric; ``tolerance`` in its unit."""

    unit: str
    direction: Literal["lower", "higher"]
    tolerance: float


@dataclass(frozen=True)
class Baseline:
    """A run to compare with: rows of scores, tolerances, and where it was made (versions, machine).

    ``recipe`` is the recipe's file that the sequences are made from, relative to the baseline's folder; empty when it is not known.
    """

    rows: tuple[dict[str, Any], ...]
    metrics: dict[str, Tolerance]
    environment: dict[str, str]
    recipe: str = ""


@dataclass(frozen=True)
class Comparison:
    """One metric: the median worsening with its 99% interval, the sequences that jumped, the verdict.

    All in the metric's unit; positive is worse whatever its direction. ``sequences``: the worst first.
    """

    key: str
    unit: str
    tolerance: float
    median: float
    low: float
    high: float
    n: int
    jumped: tuple[str, ...]
    sequences: tuple[str, ...]

    @property
    def shifted(self) -> bool:
        """Whether the whole interval lies beyond the tolerance."""
        return self.low > self.tolerance

    @property
    def worse(self) -> bool:
        """Whether this metric alone makes the run worse."""
        return self.shifted or bool(self.jumped)


@dataclass(frozen=True)
class GateResult:
    """The verdict: ``worse``, the comparisons behind it, sequences that lost or gained convergence, and it all in sentences."""

    comparisons: tuple[Comparison, ...]
    lost: tuple[str, ...]
    gained: tuple[str, ...]
    sentences: tuple[str, ...]

    @property
    def worse(self) -> bool:
        """Whether the candidate is worse than the baseline."""
        return bool(self.lost) or any(comparison.worse for comparison in self.comparisons)

    @property
    def sequences(self) -> tuple[str, ...]:
        """The sequences to look at, without repetition."""
        named = [*self.lost]
        for comparison in self.comparisons:
            named += comparison.jumped
            named += comparison.sequences if comparison.shifted else ()
        return tuple(dict.fromkeys(named))


def write_baseline(path: Path, table: pd.DataFrame, environment: Mapping[str, str], *, recipe: str = "") -> None:
    """Write a baseline from a table of scores.

    Parameters
    ----------
    path
        The JSON file, to be committed with a reason.
    table
        As from :func:`datasets.scoring.table.score_table`.
    environment
        Versions and machine, for people who wonder about a difference.
    recipe
        File of the recipe, relative to the baseline's folder, from which the sequences can be made again; empty: they cannot.
    """
    kept = ["sequence", "status", "converged", *(entry.key for entry in METRICS if entry.gated)]
    content: Document = {
        "environment": dict(environment),
        "metrics": {entry.key: _tolerance_entry(entry.key, table) for entry in METRICS if entry.gated},
        "rows": table[kept].to_dict(orient="records"),
    }
    write_document(path, "baseline", {**content, "recipe": recipe} if recipe else content)


def load_baseline(path: Path) -> Baseline:
    """Read a baseline.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    document = read_document(path, "baseline")
    unknown = [key for key in document["metrics"] if key not in {entry.key for entry in METRICS}]
    if unknown:
        raise InputError(f"{path}: at $.metrics: expected metrics of this version, came {', '.join(unknown)}; write the baseline anew.")
    rows = tuple(revived(row) for row in document["rows"])
    lacking = next(((row["sequence"], key) for row in rows for key in document["metrics"] if key not in row), None)
    if lacking is not None:
        raise InputError(f'{path}: at $.rows: sequence "{lacking[0]}": expected the metric {lacking[1]}, which is missing.')
    metrics = {key: Tolerance(entry["unit"], entry["direction"], float(entry["tolerance"])) for key, entry in document["metrics"].items()}
    return Baseline(rows, metrics, document["environment"], document.get("recipe", ""))


def compare(baseline: Baseline, candidate: Sequence[Row], *, rng: np.random.Generator) -> GateResult:
    """Compare a run's rows of scores with a baseline.

    Parameters
    ----------
    baseline
        As from :func:`load_baseline`.
    candidate
        Rows as from :func:`datasets.scoring.score.score`; sequences that the baseline does not know are left out and said.
    rng
        For the bootstrap.

    Raises
    ------
    InputError
        When a sequence of the baseline is missing in the candidate.
    """
    before = {str(row["sequence"]): row for row in baseline.rows}
    after = {str(row["sequence"]): row for row in candidate}
    missing = [name for name in before if name not in after]
    if missing:
        raise InputError(f"expected a score for every sequence of the baseline, came none for {_names(missing)}.")
    lost = tuple(name for name, row in before.items() if row["converged"] and not after[name]["converged"])
    gained = tuple(name for name, row in before.items() if not row["converged"] and after[name]["converged"])
    paired = [name for name, row in before.items() if row["converged"] and after[name]["converged"]]
    comparisons = tuple(
        _compare_metric(key, before, after, names=paired, limits=limits, rng=rng) for key, limits in baseline.metrics.items()
    )
    extra = tuple(name for name in after if name not in before)
    return GateResult(comparisons, lost, gained, _sentences(comparisons, lost, gained, extra))


def _tolerance_entry(key: str, table: pd.DataFrame) -> dict[str, Any]:
    values = table[key].to_numpy(dtype=np.float64)
    finite = values[np.isfinite(values)]
    entry = metric(key)
    tolerance = TOLERATED_SHARE * float(np.median(finite)) if len(finite) else entry.tolerance
    return {"unit": entry.unit, "direction": entry.direction, "tolerance": tolerance}


def _compare_metric(
    key: str, before: Mapping[str, Row], after: Mapping[str, Row], *, names: list[str], limits: Tolerance, rng: np.random.Generator
) -> Comparison:
    """Compare one metric over the sequences ``names``."""
    old = np.array([before[name][key] for name in names], dtype=np.float64)
    new = np.array([after[name][key] for name in names], dtype=np.float64)
    sign = 1.0 if limits.direction == "lower" else -1.0
    worsening = sign * _difference(new, old)
    median, low, high = _median_interval(worsening, rng)
    order = np.argsort(-worsening, kind="stable")
    return Comparison(
        key=key,
        unit=limits.unit,
        tolerance=limits.tolerance,
        median=median,
        low=low,
        high=high,
        n=len(names),
        jumped=tuple(names[k] for k in order if _jumps(old, new, worsening, limits)[k]),
        sequences=tuple(names[k] for k in order[:NAMED] if worsening[k] > limits.tolerance),
    )


def _difference(new: Array, old: Array) -> Array:
    """``new - old``, zero where both are the same infinity; NaN (no number where there was one) is infinitely worse."""
    with np.errstate(invalid="ignore"):
        difference = np.where(new == old, 0.0, new - old)
    lost = np.isnan(new) & ~np.isnan(old)
    return np.asarray(np.where(lost, np.inf, np.nan_to_num(difference, nan=0.0, posinf=np.inf, neginf=-np.inf)), dtype=np.float64)


def _median_interval(values: Array, rng: np.random.Generator) -> tuple[float, float, float]:
    """Median and its percentile bootstrap interval."""
    if len(values) == 0:
        return 0.0, 0.0, 0.0
    picks = rng.integers(0, len(values), size=(RESAMPLES, len(values)))
    medians = np.median(values[picks], axis=1)
    low, high = np.quantile(medians, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], method="inverted_cdf")
    return float(np.median(values)), float(low), float(high)


def _jumps(old: Array, new: Array, worsening: Array, limits: Tolerance) -> NDArray[np.bool_]:
    """Which sequences became far worse than the others' scatter explains."""
    if len(old) == 0:
        return np.zeros(0, dtype=bool)
    known = np.abs(old[~np.isnan(old)])
    level = np.maximum(np.abs(old), np.median(known) if len(known) else np.inf)
    with np.errstate(invalid="ignore"):
        scatter = 1.4826 * float(np.median(np.abs(worsening - np.median(worsening))))
    far = worsening > limits.tolerance + SCATTER * (scatter if math.isfinite(scatter) else 0.0)
    factor = np.abs(new) >= JUMP * level if limits.direction == "lower" else np.abs(new) * JUMP <= level
    return np.asarray(far & (factor | np.isnan(new)), dtype=bool)


def _sentences(
    comparisons: tuple[Comparison, ...], lost: tuple[str, ...], gained: tuple[str, ...], extra: tuple[str, ...]
) -> tuple[str, ...]:
    said = [_said(comparison) for comparison in comparisons if comparison.worse]
    if lost:
        said.insert(0, f"No longer converged: {_names(lost)}.")
    if not said:
        said.append(f"Not worse than the baseline in {len(comparisons)} metrics.")
    if gained:
        said.append(f"Newly converged: {_names(gained)}.")
    if extra:
        said.append(f"Left out, unknown to the baseline: {_names(extra)}.")
    return tuple(said)


def _said(comparison: Comparison) -> str:
    unit = "" if comparison.unit == "1" else f" {comparison.unit}"
    parts = []
    if comparison.shifted:
        parts.append(
            f"worse by {comparison.median:.3g}{unit} in the median of {comparison.n} sequences (99%: {comparison.low:.3g} to "
            f"{comparison.high:.3g}, tolerated {comparison.tolerance:.3g}), most in {_names(comparison.sequences)}"
        )
    if comparison.jumped:
        parts.append(f"far worse in {_names(comparison.jumped)}")
    return f"{comparison.key}: {'; '.join(parts)}."


def _names(names: Sequence[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
