"""The recorder runs faster or slower than it says.

``true time = nominal time / (1 + relative)``, counted from the first frame. Valid for any steady clock, ``relative > -1``. Without a known
force a wrong frame rate is degenerate with the velocities; gravity breaks that.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values

Array = NDArray[np.float64]


def true_times(times_s: Array, values: Values, _rng: np.random.Generator) -> Array:
    """True times (frame,) s."""
    return np.asarray(times_s[0] + (times_s - times_s[0]) / (1 + values["relative"]))
