"""Slow errors of the poses of a motion: polynomials of time that its own parameters do not take up.

Along every axis a translation and a rotation are Legendre polynomials of the orders 2, 3 and 4 of time over each segment between impacts.
Orders 0 and 1 of the path are the motion's own; of the rotation order 0 is, and order 1 the less, the more a body tumbles.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander
from numpy.typing import NDArray

from estimator.motion.flight import Motion
from estimator.motion.piecewise import PiecewiseFlight, segment_of

Array = NDArray[np.float64]
ORDERS = (2, 3, 4)
"""Degrees of the polynomials in time on which a flight's residuals are tested: 0 and 1 are taken up by the flight itself, or nearly."""
AXES = ("path along x", "path along y", "path along z", "rotation about x", "rotation about y", "rotation about z")
PATH, ROTATION = [0, 1, 2], [3, 4, 5]
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

    def of_segment(self, segment: int) -> slice:
        """Where the coefficients of a segment lie."""
        size = len(AXES) * len(ORDERS)
        first = self.segments.index(segment) * size
        return slice(first, first + size)

    def columns(self, axis: int, segment: int) -> slice:
        """Where those of an axis of a segment lie."""
        first = self.of_segment(segment).start + axis * len(ORDERS)
        return slice(first, first + len(ORDERS))

    def velocities(self, b: Array, time_s: float, segment: int, omega: Array) -> Array:
        """What coefficients ``b`` (k,) are in velocity and angular velocity (6,) m/s and rad/s, world frame, were they the motion's.

        ``omega`` (3,) rad/s, world frame, there. A body that is turned by a rotation vector phi(t) more turns by dphi/dt + phi x omega
        faster. Polynomials go no further than the frames: before and after these they are as at the nearest one.
        """
        low, high = self.spans_s[self.segments.index(segment)]
        at, scale = min(max(2.0 * (time_s - low) / (high - low) - 1.0, -1.0), 1.0), 2.0 / (high - low)
        own = [np.concatenate([np.zeros(min(ORDERS)), b[self.columns(axis, segment)]]) for axis in range(len(AXES))]
        moved = scale * np.array([legval(at, legder(coefficients)) for coefficients in own])
        moved[ROTATION] += np.cross([legval(at, own[axis]) for axis in ROTATION], omega)
        return moved


def slow_errors(times_s: Array, motion: Motion) -> SlowErrors:
    """Those of a ``motion`` that was seen at ``times_s`` (n,)."""
    of = segment_of(motion, times_s) if isinstance(motion, PiecewiseFlight) else np.zeros(len(times_s), dtype=np.int64)
    segments = tuple(int(k) for k in np.unique(of) if len(np.unique(times_s[of == k])) > max(ORDERS))
    spans = tuple((float(times_s[of == k].min()), float(times_s[of == k].max())) for k in segments)
    slow = SlowErrors(np.zeros((len(times_s), len(AXES), len(segments) * len(AXES) * len(ORDERS))), segments, spans)
    for segment, (low, high) in zip(segments, spans, strict=True):
        P = legvander(2.0 * (times_s[of == segment] - low) / (high - low) - 1.0, max(ORDERS))[:, list(ORDERS)]
        for axis in range(len(AXES)):
            slow.basis[of == segment, axis, slow.columns(axis, segment)] = P
    return slow
