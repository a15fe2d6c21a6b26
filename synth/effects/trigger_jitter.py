"""Frames are triggered a little early or late, each on its own.

``true time_i = nominal time_i + sigma N(0, 1)`` [random effect: Laird and Ware, Biometrics 38 (1982) 963]. Frames keep their order as long
as ``sigma`` is well below the frame interval; exposures keep their length.

Valid for times that are independent from frame to frame.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values

Array = NDArray[np.float64]


def true_times(times_s: Array, values: Values, rng: np.random.Generator) -> Array:
    """True times (frame,) s."""
    return np.asarray(times_s + values["sigma"] * rng.normal(size=len(times_s)))
