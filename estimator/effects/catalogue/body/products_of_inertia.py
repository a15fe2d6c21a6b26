"""Principal axes elsewhere than those of the uniform body, or than the axes that a sensor has [Goldstein 1980, ch. 5].

``Iij = eij sqrt(Ii Ij)``. A gyroscope on a body that spins about such an axis reads a constant beside the spin, as one with a bias does,
but one that grows with the spin. Valid for rigid bodies.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, BodyChange, EffectModel, Setting


class ProductsOfInertia(EffectModel):
    """Products over the geometric means of the moments."""

    entry = EFFECTS["products_of_inertia"]

    def body(self, theta: Array, setting: Setting) -> BodyChange:
        """``E12``, ``E13`` and ``E23`` of the flight's inertia."""
        del setting
        return BodyChange(np.zeros(3), np.concatenate([np.zeros(2), theta]))
