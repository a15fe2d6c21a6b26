"""When each frame was exposed. A frame's time is the middle of its exposure."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


@dataclass(frozen=True)
class Clock:
    """``times_s`` (frame,) s, strictly increasing; ``exposure_s`` the length of each exposure (s)."""

    times_s: Float[NDArray[np.float64], " frame"]
    exposure_s: float
