"""Outlines moved along their own normals: corners by more where the outline recedes and, as they are seen, where it widens, too."""

import numpy as np

from estimator.effects.link import Array, Places
from estimator.geometry.outline_shape import DEPTHS_PX


def moved_outline(delta_px: Array, places: Places) -> Array:
    """Displacement (n, k, 2) px of the tangents where the outline moves by ``delta_px`` (n, k, 2), outwards positive.

    What corners do is tabled by depth (:mod:`estimator.geometry.outline_shape`) and interpolated.
    """
    inwards, outwards = (tabled(table, np.abs(delta_px), DEPTHS_PX) for table in (places.erosion, places.dilation))
    return np.asarray(np.where(delta_px < 0.0, inwards, outwards) * delta_px)


def tabled(table: Array, at_px: Array, knots_px: Array) -> Array:
    """What a ``table`` (n, k, 2, D) at ``knots_px`` (D,) tells of ``at_px`` (n, k, 2), linear between knots and constant beyond.

    Nothing is told (NaN) of what is no number, as of places that a flight led astray never reached.
    """
    last = len(knots_px) - 1
    place = np.interp(at_px, knots_px, np.arange(last + 1.0))
    low = np.minimum(np.nan_to_num(place).astype(np.int64), last - 1)
    near, far = (np.take_along_axis(table, each[..., None], axis=-1)[..., 0] for each in (low, low + 1))
    return np.asarray(near + (place - low) * (far - near))
