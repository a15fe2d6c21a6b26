"""Blur that grows with the distance from the focal plane: half-level contours recede where they are curved.

The recession of every tangent under a blur is tabled from the outlines that the body casts (:mod:`estimator.geometry.outline_shape`), over
the blur, and interpolated [Verbeek and van Vliet 1994]: linear in the blur, as a smooth stretch's share is, or constant, as a corner's.
Below the smallest blur of the table it falls to zero with the blur: zero blur and small blur differ by a square.

``s = blur |z - z_first|``. Valid where the blur is well below the outline.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting
from estimator.effects.receding import tabled
from estimator.geometry.outline_shape import BLURS_PX

SMALLEST = 15.0
"""Blur (px/m) whose slope stands for that of smaller ones."""


class DefocusGrowth(EffectModel):
    """Receding outlines away from the focal plane."""

    entry = EFFECTS["defocus_growth"]
    accuracy = 0.1
    accuracy_at_spikes = 0.1

    def slope_at(self, theta: Array) -> Array:
        """At least ``SMALLEST``: zero blur has no slope."""
        return np.maximum(np.abs(theta), SMALLEST)

    def first_guess(self, theta: Array) -> Array:
        """Blur that recedes as far as the linear step with the slope at ``SMALLEST`` says: ``b² = 2 SMALLEST theta``."""
        return np.sqrt(np.maximum(2.0 * SMALLEST * theta, SMALLEST**2))

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """The tabled recession, times the blur."""
        del setting
        s = np.abs(theta[0] * (places.depth_m - places.first_depth_m))[:, None, None]
        share = tabled(places.recession, np.broadcast_to(s, places.radius_px.shape), BLURS_PX)
        return np.asarray(-s * np.minimum(s / BLURS_PX[0], 1.0) * share)
