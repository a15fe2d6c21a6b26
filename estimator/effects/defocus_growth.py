"""Blur that grows with the distance from the focal plane: half-level contours recede where they are curved.

A Gaussian blur of standard deviation s moves the half level of a disk's rim by s² / (2 rho) inwards [Verbeek and van Vliet 1994], and
that of a right angle's corner by 0.77 s; ``-s² / (2 rho + 1.3 s)`` joins the two. Zero blur and small blur differ by a square.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting

SMALLEST = 15.0
"""Blur (px/m) whose slope stands for that of smaller ones."""


class DefocusGrowth(EffectModel):
    """Receding outlines away from the focal plane."""

    entry = EFFECTS["defocus_growth"]

    def slope_at(self, theta: Array) -> Array:
        """At least ``SMALLEST``: zero blur has no slope."""
        return np.maximum(np.abs(theta), SMALLEST)

    def first_guess(self, theta: Array) -> Array:
        """Blur that recedes as far as the linear step with the slope at ``SMALLEST`` says: ``b² = 2 SMALLEST theta``."""
        return np.sqrt(np.maximum(2.0 * SMALLEST * theta, SMALLEST**2))

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """``-s² / (2 rho + 1.3 s)``."""
        del setting
        s = np.abs(theta[0] * (places.depth_m - places.first_depth_m))[:, None, None]
        return np.asarray(-(s**2) / np.maximum(2.0 * places.radius_px + 1.3 * s, 1e-9))
