"""Outlines too large or too small by a constant: a threshold off the half level, or a contour convention [Forbes 2007, ch. 4].

``delta = offset``. Valid for offsets well below the outline's radii of curvature, and beyond by what is tabled of corners.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting
from estimator.effects.receding import moved_outline


class OutlineOffset(EffectModel):
    """A constant displacement along the normal; outlines that recede lose more at corners."""

    entry = EFFECTS["outline_offset"]
    accuracy = 0.03
    accuracy_at_spikes = 0.15

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """The constant."""
        del setting
        return moved_outline(np.full(places.radius_px.shape, float(theta[0])), places)

    def displaced(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """The constant: a parallel curve is as far from the outline everywhere."""
        del setting
        return np.full(places.radius_px.shape, float(theta[0]))
