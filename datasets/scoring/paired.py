"""Errors of the same sequences by two runs, or by two instruments: by what factor those of the second are larger, with an interval.

Runs are paired by sequence, so that what is hard about a sequence cancels. Of every sequence the logarithm of the ratio
``(second + f) / (first + f)`` is taken, ``f`` a share of the median error of the first: an error that is near zero by luck decides
nothing. Log-ratios are cut, so that one sequence neither decides alone nor hides by its size that all others are worse, too; a sequence
that one of the two does not measure has the ratio at which they are cut. Their mean has the interval of Student's t [Student 1908]. Where
the two differ by noise alone a log-ratio is symmetric about zero, with tails that are cut: t is then on the safe side, unless either loses
many of few sequences, whose ratios all lie at the cut (6 to 9% in place of 5% for six to eight, of which either loses half).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import stdtrit

Array = Float[NDArray[np.float64], " n"]

FLOOR_SHARE = 0.25
"""What is added to errors before ratios are taken, as a share of their median in the first run."""


@dataclass(frozen=True)
class Paired:
    """The mean ratio of errors, second over first, over the ``n`` sequences that either measures, with the ends of its interval.

    ``log_ratios`` (all sequences) are cut; NaN where neither measured.
    """

    n: int
    ratio: float
    low: float
    high: float
    log_ratios: Array


def log_ratios(first: Array, second: Array, *, least: float = 0.0) -> Array:
    """Logarithms (n,) of ratios of errors (n,) of any unit, NaN where not measured; ``least``: what is added to errors at least."""
    there = first[np.isfinite(first)]
    floor = max(FLOOR_SHARE * float(np.median(there)) if len(there) else 0.0, least)
    with np.errstate(invalid="ignore", divide="ignore"):
        logs = np.where(second == first, 0.0, np.log(second + floor) - np.log(first + floor))
    return _with_the_lost(logs, first, second)


def differences(first: Array, second: Array) -> Array:
    """As :func:`log_ratios`, of measures that are logarithms already (nats)."""
    return _with_the_lost(second - first, first, second)


def _with_the_lost(logs: Array, first: Array, second: Array) -> Array:
    """A number that the second lacks is infinitely worse, one that the first lacks infinitely better."""
    lost, gained = np.isnan(second) & ~np.isnan(first), np.isnan(first) & ~np.isnan(second)
    return np.where(lost, np.inf, np.where(gained, -np.inf, logs))


def paired(logs: Array, *, cut: float, level: float) -> Paired:
    """The comparison of log-ratios (n,) that are cut at the ratio ``cut``; the mean lies beyond either end with a chance of ``level``."""
    within = np.clip(logs, -np.log(cut), np.log(cut))
    there = within[np.isfinite(within)]
    mean, half = (float(there.mean()), _half_width(there, level)) if len(there) else (0.0, np.inf)
    with np.errstate(over="ignore"):
        ratio, low, high = (float(np.exp(value)) for value in (mean, mean - half, mean + half))
    return Paired(len(there), ratio, low, high, within)


def _half_width(values: Array, level: float) -> float:
    """Of Student's interval; infinite for a single value."""
    if len(values) < 2:
        return float("inf")
    return float(stdtrit(len(values) - 1, 1 - level) * values.std(ddof=1) / np.sqrt(len(values)))
