"""Outlines of the calibrated views too large or too small by a constant number of their pixels [Forbes 2007, ch. 4].

In the high-speed camera's pixels it is an outline offset of the other sign, magnified by the ratio of scales; where that ratio does not
vary the two cannot be told apart.

``delta = o r``, r px of error per px of a view's outline. Valid for offsets well below the outline's radii of curvature.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting


class ViewOutlineOffset(EffectModel):
    """A constant offset of the calibrated views' outlines."""

    entry = EFFECTS["view_outline_offset"]
    accuracy = 0.1

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """The views' offset seen through the pairs."""
        del setting
        return theta[0] * places.view_ratio
