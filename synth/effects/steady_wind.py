"""Air that moves steadily.

``u = v - w``, in the place of v in every drag and lift [Hoerner, Fluid-Dynamic Drag (1965), ch. 1]; no force of its own.

Valid where the wind is the same all over the flight.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values


def velocity(values: Values) -> NDArray[np.float64]:
    """Velocity of the air (3,) m/s, world frame."""
    return np.array([values["w_x"], values["w_y"], values["w_z"]])
