"""Frames that were taken at even intervals, and stamps that scatter about them: rounded, or read off a host's clock when a frame came in.

``t_true = t + share (t_even - t)``: ``t_even = t_0 + T k`` are the even times nearest to the stamps, k whole numbers that grow from frame
to frame [Olson 2010]. A share of 1: all of the scatter is the stamps' own; of 0: frames were as uneven as their stamps. Such errors
move what is measured along its motion and go with time or place where a host is busier there, so they are neither noise nor jitter.

Valid for frames of one interval, of which at most as many are lost as there are, and stamps that are off by less than half an interval as
a rule. What the interval is, the stamps of all sequences of a campaign say together; those of one that it does not number alike, their own.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting
from estimator.geometry.robust_scale import robust_sigma

BEGIN = 128
"""Stamps of which the interval is sought first, then twice as many at a time, so that no frame is miscounted. Effort alone."""
ROUNDS = 8
"""Of weighing stamps by how near they are to even times."""
EXACT = 1e-6
"""Of an interval: stamps that are as even as this scatter by rounding of numbers alone."""


class StampScatter(EffectModel):
    """Frames at even times."""

    entry = EFFECTS["stamp_scatter"]

    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """Times moved towards even ones, row by row; others than those of the rows as their neighbours."""
        off, stamps = setting.scatter_s, setting.times_s
        if off is None or len(off) != len(stamps):
            return times_s
        return times_s + theta[0] * (off if len(times_s) == len(stamps) else np.interp(times_s, stamps, off))


def to_even_times(stamps: Sequence[Array]) -> list[Array]:
    """By how much later (n,) s than its stamp each frame of several sequences was, if all were taken at even times.

    ``stamps`` (n,) s of each, growing. Zero where they are even.
    """
    lines = [_line(t) for t in stamps]
    told = [i for i, t in enumerate(stamps) if len(t) > 2]
    if not told:
        return [np.zeros(len(t)) for t in stamps]
    order = sorted(told, key=lambda i: float(lines[i][0]))
    weights = np.cumsum([float(len(stamps[i])) ** 3 for i in order])  # what a sequence knows of its interval
    shared = float(lines[order[int(np.searchsorted(weights, 0.5 * weights[-1]))]][0])
    return [_off(t, line, shared) for t, line in zip(stamps, lines, strict=True)]


def _off(t: Array, line: Array, shared: float) -> Array:
    """From stamps (n,) to times at the ``shared`` interval (s); where it numbers frames otherwise than their own does, at their own."""
    k = _numbers(t, line)
    at_shared = np.array([shared, float(np.median(t - shared * k))])
    numbers = _numbers(t, at_shared)
    alike = len(t) <= 2 or np.array_equal(numbers - numbers[0], k - k[0])
    off = (at_shared[1] + shared * numbers if alike else line[1] + line[0] * k) - t
    return np.zeros(len(t)) if len(t) <= 2 or np.abs(off).max() < EXACT * line[0] else off


def _line(t: Array) -> Array:
    """Interval and first even time (2,) s of stamps (n,): the line through them by frames' numbers, those far off weighing less."""
    if len(t) <= 2:
        return np.array([float(np.ptp(t)) or 1.0, float(t[0])])
    rows = min(BEGIN, len(t))
    line = np.array([_interval(t[:rows]), t[0]])
    line[1] += _middle(t[:rows] - t[0], line[0])
    while True:
        for _ in range(ROUNDS):
            line = _nearer(t[:rows], line)
        if rows == len(t):
            return line
        rows = min(2 * rows, len(t))


def _interval(t: Array) -> float:
    """The interval (s) at which stamps (n,) are most alike in phase, of those that lay half a frame more or less from first to last."""
    span = float(t[-1] - t[0])
    counts = 0.5 * np.arange(2 * len(t) - 3, 4 * len(t))
    together = np.abs(np.exp(2j * np.pi * np.outer(counts, (t - t[0]) / span)).mean(axis=1))
    return span / float(counts[np.argmax(together)])


def _middle(t: Array, interval: float) -> float:
    """The mean phase (s) of times (n,)."""
    return float(np.angle(np.exp(2j * np.pi * t / interval).mean())) / (2.0 * np.pi) * interval


def _nearer(t: Array, line: Array) -> Array:
    """The line (2,) through stamps (n,) by their numbers, weights those of Cauchy's density of what stamps are off the last one."""
    k = _numbers(t, line)
    off = t - line[1] - line[0] * k
    scale = max(float(robust_sigma(off)), EXACT * line[0])
    return np.polyfit(k, t, 1, w=1.0 / np.hypot(1.0, off / scale))


def _numbers(t: Array, line: Array) -> NDArray[np.float64]:
    """The whole numbers (n,), each larger than the one before, of stamps: of two frames with one number the one moves that has room."""
    rows = np.arange(len(t), dtype=np.float64)
    k = np.round((t - line[1]) / line[0]) - rows
    ways = np.minimum.accumulate(k[::-1])[::-1] + rows, np.maximum.accumulate(k) + rows
    return min(ways, key=lambda each: float(np.abs(t - line[1] - line[0] * each).sum()))
