"""A flat plate on which particles fall: a plane in the world frame.

Points ``x`` of the plate's surface satisfy ``n . (x - (p + V t)) = 0``, ``n`` the unit normal into the side where particles are free, ``t``
counted from the first frame. The plane has no edge here; where a plate ends in a picture is told by its outline in that picture.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


@dataclass(frozen=True)
class Plate:
    """``point_world`` (3,) m at time zero, ``normal_world`` (3,) unit, into the free side, ``velocity_world`` (3,) m/s.

    ``normal_sigma_rad``: standard deviation of the normal's direction about each of two axes across it; ``offset_sigma_m``: that of the
    plane's place along its normal, at the point. 0: known exactly.
    """

    point_world: Float[NDArray[np.float64], "3"]
    normal_world: Float[NDArray[np.float64], "3"]
    velocity_world: Float[NDArray[np.float64], "3"] = field(default_factory=lambda: np.zeros(3))
    normal_sigma_rad: float = 0.0
    offset_sigma_m: float = 0.0

    def height_m(self, points_world: Float[NDArray[np.float64], "*batch 3"], time_s: float) -> Float[NDArray[np.float64], "*batch"]:
        """Height (m) of points above the plane at ``time_s``; negative behind it."""
        return np.asarray((points_world - self.point_world - self.velocity_world * time_s) @ self.normal_world)
