"""Frames are lost and the recorder goes on counting.

Every frame after number ``after_frame`` was taken ``count`` nominal frame intervals later than its time stamp says. A ``count`` that is no
integer is a pause of that length. Valid for a steady nominal frame rate.

``t_true = t + count / rate`` after the gap.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values

Array = NDArray[np.float64]


def true_times(times_s: Array, values: Values, _rng: np.random.Generator) -> Array:
    """True times (frame,) s; the interval is the median one of ``times_s``."""
    interval = float(np.median(np.diff(times_s)))
    late = np.arange(len(times_s)) > values["after_frame"]
    return np.asarray(times_s + values["count"] * interval * late)
