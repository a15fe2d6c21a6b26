"""A warming lens: its focal length drifts during a sequence. The catalogue does not know it.

``f (1 + relative (1 - exp(-t / time_constant)))``, ``t`` the time stamp counted from the sequence's first frame [first-order warming;
Smith, Clarke and Robson, ISPRS Archives 37-B5 (2008)]. The picture grows about the principal point.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from synth.effects.links import Sway, Values


def sway(times_s: NDArray[np.float64], values: Values) -> Sway:
    """The picture's growth at instants (n,) s.

    Raises
    ------
    InputError
        Where the time constant is not positive.
    """
    if values["time_constant"] <= 0:
        raise InputError(f"thermal_focus_drift: expected a positive time_constant, got {values['time_constant']:g} s.")
    warmed = -np.expm1(-times_s / values["time_constant"])
    return Sway(1 + values["relative"] * warmed, np.zeros((len(times_s), 2)))
