"""Where a convex particle touches a plate: the vertex of its hull that lies lowest towards the plate, at the pose of the impact."""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.solid import BodyState

Array = NDArray[np.float64]


def support_point(state: BodyState, vertices_body: Array, plate: Plate) -> Array:
    """Where (3,) m, world frame, the lowest of ``vertices_body`` (v, 3) m, body axes, towards the plate lies."""
    placed = state.x_world + vertices_body @ state.R_world_body.T
    return np.asarray(placed[np.argmin(placed @ plate.normal_world)])
