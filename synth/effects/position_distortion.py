"""A tracker whose volume is distorted: points are seen displaced by a share that grows with their distance from its middle.

``seen = x + k |d|² d / R² + (|d|² p + 2 d (d · p)) / R``, ``d = x - c`` from the middle c: radial, and where the distortion is not centred
[Brown 1971, in space]. Valid for small k and p.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values


def seen(x_world: NDArray[np.float64], middle: NDArray[np.float64], reach_m: float, values: Values) -> NDArray[np.float64]:
    """Positions (n, 3) m that are reported of points at ``x_world`` (n, 3) m; ``middle`` (3,) m, ``reach_m`` R."""
    reported = []
    for arm in x_world - middle:
        decentred = np.array([values["p_x"], values["p_y"], values["p_z"]])
        square = float(arm @ arm)
        moved = values["k"] * square / reach_m**2 * arm + (square * decentred + 2.0 * float(arm @ decentred) * arm) / reach_m
        reported.append(middle + arm + moved)
    return np.array(reported)
