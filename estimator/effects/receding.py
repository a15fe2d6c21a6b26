"""Outlines moved along their own normals: all tangents by as much where the outline widens, corners by more where it recedes."""

import numpy as np

from estimator.effects.link import Array, Places
from estimator.geometry.outline_shape import DEPTHS_PX


def moved_outline(delta_px: Array, places: Places) -> Array:
    """Displacement (n, k, 2) px of the tangents where the outline moves by ``delta_px`` (n, k, 2), outwards positive.

    The recession at corners is tabled by depth (:mod:`estimator.geometry.outline_shape`) and interpolated.
    """
    last = len(DEPTHS_PX) - 1
    place = np.interp(-delta_px, DEPTHS_PX, np.arange(last + 1.0))
    low = np.minimum(place.astype(np.int64), last - 1)
    near, far = (np.take_along_axis(places.erosion, each[..., None], axis=-1)[..., 0] for each in (low, low + 1))
    return np.asarray(np.where(delta_px < 0.0, near + (place - low) * (far - near), 1.0) * delta_px)
