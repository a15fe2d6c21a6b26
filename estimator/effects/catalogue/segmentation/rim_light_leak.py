"""Light through facets that lie along the line of sight: the outline recedes where it is flat, ``delta = -a f / (1 + f)``.

``f`` is the length of outline whose normals lie within 10 degrees, over the same of a circle of equal perimeter, of the flattest stretch
within 3 px: a corner recedes with the facets that meet in it. What the tangents recede is tabled by ``a`` from the outlines that the body
casts (:mod:`estimator.geometry.outline_shape`).

Facets along the line of sight refract and reflect least [Born and Wolf, Principles of Optics (1999), ch. 1]. Valid for losses of a few px,
on bodies without hollows; on others the hull shows a part of the flat stretches.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting
from estimator.effects.receding import tabled
from estimator.geometry.outline_shape import DEPTHS_PX


class RimLightLeak(EffectModel):
    """Receding flat stretches of a transparent particle's outline."""

    entry = EFFECTS["rim_light_leak"]
    accuracy = 0.1
    accuracy_at_spikes = 0.4

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """The tabled recession, times the loss."""
        del setting
        return np.asarray(-theta[0] * tabled(places.leak, np.full(places.radius_px.shape, float(theta[0])), DEPTHS_PX))
