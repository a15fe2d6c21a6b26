"""A further camera's frames are taken later than stamped, by the clock of the first one.

``true time = stamp + offset``: a trigger cable, a delay line, a recorder that begins one frame late. Valid for a delay that stays.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values

Array = NDArray[np.float64]


def true_times(times_s: Array, values: Values, _rng: np.random.Generator) -> Array:
    """True times (frame,) s."""
    return np.asarray(times_s + values["offset"])
