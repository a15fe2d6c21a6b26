"""Where a convex particle touches a plate: the vertex of its hull that lies lowest towards the plate, at the pose of the impact."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.solid import BodyState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SupportPoint:
    """``point_world`` (3,) m; ``vertex`` its number; ``clearance_m``: by how much the next vertex lies higher above the plate.

    A clearance near 0 says that an edge or a face arrives, which one contact point cannot stand for.
    """

    point_world: Array
    vertex: int
    clearance_m: float


def support_point(state: BodyState, vertices_body: Array, plate: Plate) -> SupportPoint:
    """The lowest of ``vertices_body`` (v, 3) m towards the plate."""
    placed = state.x_world + vertices_body @ state.R_world_body.T
    heights = placed @ plate.normal_world
    order = np.argsort(heights, kind="stable")
    clearance = float(heights[order[1]] - heights[order[0]]) if len(order) > 1 else float("inf")
    return SupportPoint(placed[order[0]], int(order[0]), clearance)
