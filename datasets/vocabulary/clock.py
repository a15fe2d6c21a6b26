"""When each frame was exposed. A frame's time is the middle of its exposure."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


@dataclass(frozen=True)
class Clock:
    """``times_s`` (frame,) s, strictly increasing; ``exposure_s`` the length of each exposure (s).

    Of a further camera, how well its clock is known against that of the first one: with stamp ``t`` a frame was taken at
    ``t + offset + rate (t - t_0)`` by the first camera's clock, ``t_0`` the further camera's first stamp. ``offset_sigma_s`` and
    ``rate_sigma`` are standard deviations of offset (s) and rate about zero; 0: the stamps are those of the first camera's clock.
    """

    times_s: Float[NDArray[np.float64], " frame"]
    exposure_s: float
    offset_sigma_s: float = 0.0
    rate_sigma: float = 0.0

    @property
    def known(self) -> bool:
        """Whether its stamps are those of the first camera's clock."""
        return self.offset_sigma_s == 0.0 and self.rate_sigma == 0.0
