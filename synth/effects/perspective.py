"""A tracker whose scale is not the same everywhere: what is nearer to the camera than the rest seems larger.

``seen = c + d / (1 - q · d / R)``, ``d = x - c`` from the middle c [Hartley and Zisserman 2004, ch. 2]. Valid where ``q · d < R``.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values


def seen(x_world: NDArray[np.float64], middle: NDArray[np.float64], reach_m: float, values: Values) -> NDArray[np.float64]:
    """Positions (n, 3) m that are reported of points at ``x_world`` (n, 3) m; ``middle`` (3,) m, ``reach_m`` R."""
    nearer = np.array([values["q_x"], values["q_y"], values["q_z"]]) / reach_m
    return np.array([middle + (point - middle) / (1.0 - float(nearer @ (point - middle))) for point in x_world])
