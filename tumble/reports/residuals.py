"""How far the outline that was seen lies from the estimated one: signed distances along it, positive where what was seen lies outside."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from jaxtyping import Bool, Float
from numpy.typing import NDArray

FEWEST_POINTS = 3


@dataclass(frozen=True)
class Residuals:
    """Points of the outline that was seen (n, 2) px, the nearest of the estimated one (n, 2) px, and signed distances (n,) px."""

    seen_px: Float[NDArray[np.float64], "n 2"]
    nearest_px: Float[NDArray[np.float64], "n 2"]
    distance_px: Float[NDArray[np.float64], " n"]

    @cached_property
    def rms_px(self) -> float:
        """Root mean square distance, px."""
        return float(np.sqrt(np.mean(self.distance_px**2)))

    @cached_property
    def mean_px(self) -> float:
        """Mean signed distance, px."""
        return float(np.mean(self.distance_px))

    @cached_property
    def largest_px(self) -> float:
        """Largest distance, px."""
        return float(np.max(np.abs(self.distance_px)))


def outline_residuals(
    seen: Float[NDArray[np.float64], "n 2"], estimated: Float[NDArray[np.float64], "m 2"], unsure: Bool[NDArray[np.bool_], " k"]
) -> Residuals | None:
    """Residuals of the points of ``seen`` that are sure (no entries in ``unsure``: all); ``None`` where an outline is missing."""
    sure = seen[~unsure] if len(unsure) else seen
    if min(len(sure), len(estimated)) < FEWEST_POINTS:
        return None
    body = shapely.make_valid(shapely.Polygon(estimated))
    points, ring = shapely.points(sure), shapely.LinearRing(estimated)
    nearest = shapely.line_interpolate_point(ring, shapely.line_locate_point(ring, points))
    sign = np.where(shapely.contains_xy(body, sure[:, 0], sure[:, 1]), -1.0, 1.0)
    return Residuals(sure, shapely.get_coordinates(nearest), sign * shapely.distance(points, nearest))
