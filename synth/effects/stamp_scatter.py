"""Frames come at even intervals, and their stamps are rounded or late.

``true time = stamp + share (even - stamp)``, even times those of the straight line through the stamps by the frames' numbers, by least
squares. Valid where no frame is lost and stamps are off by less than half an interval.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values

Array = NDArray[np.float64]


def true_times(times_s: Array, values: Values, _rng: np.random.Generator) -> Array:
    """True times (frame,) s."""
    number = np.arange(len(times_s))
    even = np.polynomial.Polynomial.fit(number, times_s, 1)(number)
    return np.asarray(times_s + values["share"] * (even - times_s))
