"""Outlines: closed polygons in pixel coordinates, the outer boundary of a silhouette.

The first point is not repeated. The shoelace area in (x right, y down) pixel coordinates is positive.
An empty outline (0 points) says that nothing usable was seen.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


@dataclass(frozen=True)
class Outline:
    """One closed polygon; ``points_px`` is (n, 2) in px."""

    points_px: Float[NDArray[np.float64], "n 2"]

    @property
    def empty(self) -> bool:
        """Whether there is no outline."""
        return len(self.points_px) == 0


def signed_area(points: Float[NDArray[np.float64], "n 2"]) -> float:
    """Shoelace area (squared units of ``points``); positive for the orientation this project uses."""
    x, y = points[:, 0], points[:, 1]
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def oriented(points: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], "n 2"]:
    """The same polygon, turned round where its signed area is negative."""
    with np.errstate(all="ignore"):  # of coordinates that no picture has, which are refused elsewhere
        return points if signed_area(points) >= 0 else points[::-1].copy()
