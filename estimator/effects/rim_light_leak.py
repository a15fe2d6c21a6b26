"""Light through facets that lie along the line of sight: the outline recedes where it is flat, ``delta = -a f / (1 + f)``.

``f`` is the length of outline whose normals lie within 10 degrees, over the same of a circle of equal perimeter, of the flattest stretch
within 3 px: a corner recedes with the facets that meet in it.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting
from estimator.effects.receding import moved_outline


class RimLightLeak(EffectModel):
    """Receding flat stretches of a transparent particle's outline."""

    entry = EFFECTS["rim_light_leak"]

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """Recession by the flatness of the outline."""
        del setting
        flatness = places.flattest_px / places.perimeter_radius_px[:, None, None]
        return moved_outline(-theta[0] * flatness / (1.0 + flatness), places)
