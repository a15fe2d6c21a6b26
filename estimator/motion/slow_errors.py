"""Slow errors of the poses of a motion: polynomials of time that its own parameters do not take up.

Along every axis a translation and a rotation are Legendre polynomials of the orders 2, 3 and 4 of time over each segment between impacts;
orders 0 and 1 are the motion's own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander
from numpy.typing import NDArray

from estimator.motion.flight import Motion
from estimator.motion.piecewise import PiecewiseFlight

Array = NDArray[np.float64]
ORDERS = (2, 3, 4)
"""Degrees of the polynomials in time on which a flight's residuals are tested: 0 and 1 are taken up by the flight itself."""
AXES = ("path along x", "path along y", "path along z", "rotation about x", "rotation about y", "rotation about z")
PATH, ROTATION = range(3), range(3, 6)
"""Which of the axes are of the path, which of the rotation."""


@dataclass(frozen=True)
class SlowErrors:
    """What they move poses by, ``basis`` (n, 6, k) m and rad, world frame, over each of the ``segments``.

    A segment is what lies between two impacts, by its number; those of too few frames to determine the polynomials have none. ``spans_s``:
    when the frames of each begin and end.
    """

    basis: Array
    segments: tuple[int, ...]
    spans_s: tuple[tuple[float, float], ...]

    def columns(self, axis: int, segment: int) -> slice:
        """Where the coefficients of an axis of a segment lie."""
        first = (self.segments.index(segment) * len(AXES) + axis) * len(ORDERS)
        return slice(first, first + len(ORDERS))

    def velocities(self, b: Array, time_s: float, segment: int) -> Array:
        """What coefficients ``b`` (k,) are in velocity and angular velocity (6,) m/s and rad/s, world frame; none of another segment."""
        if segment not in self.segments:
            return np.zeros(len(AXES))
        low, high = self.spans_s[self.segments.index(segment)]
        at, own = 2.0 * (time_s - low) / (high - low) - 1.0, [b[self.columns(axis, segment)] for axis in range(len(AXES))]
        slopes = [legval(at, legder(np.concatenate([np.zeros(min(ORDERS)), coefficients]))) for coefficients in own]
        return np.array(slopes) * 2.0 / (high - low)


def slow_errors(times_s: Array, motion: Motion) -> SlowErrors:
    """Those of a ``motion`` that was seen at ``times_s`` (n,)."""
    of = segment_of(motion, times_s)
    segments = tuple(k for k in range(int(of.max(initial=0)) + 1) if np.count_nonzero(of == k) > max(ORDERS))
    spans = tuple((float(times_s[of == k].min()), float(times_s[of == k].max())) for k in segments)
    slow = SlowErrors(np.zeros((len(times_s), len(AXES), len(segments) * len(AXES) * len(ORDERS))), segments, spans)
    for segment, (low, high) in zip(segments, spans, strict=True):
        P = legvander(2.0 * (times_s[of == segment] - low) / (high - low) - 1.0, max(ORDERS))[:, list(ORDERS)]
        for axis in range(len(AXES)):
            slow.basis[of == segment, axis, slow.columns(axis, segment)] = P
    return slow


def segment_of(motion: Motion, times_s: Array) -> NDArray[np.intp]:
    """How many impacts of a ``motion`` are before each of ``times_s`` (n,)."""
    impacts = motion.times_s if isinstance(motion, PiecewiseFlight) else np.zeros(0)
    return np.searchsorted(impacts, times_s)
