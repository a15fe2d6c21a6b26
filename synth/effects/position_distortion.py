"""A tracker whose volume is distorted: points are seen too far from its middle, or too near, by a share that grows with their distance.

``seen = x + k (|x - c| / R)² (x - c)``, radially symmetric about c [Luhmann, Robson, Kyle and Boehm 2014, ch. 3.3]. Valid for small k.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values


def seen(x_world: NDArray[np.float64], middle: NDArray[np.float64], reach_m: float, values: Values) -> NDArray[np.float64]:
    """Positions (n, 3) m that are reported of points at ``x_world`` (n, 3) m; ``middle`` (3,) m, ``reach_m`` R."""
    arm = x_world - middle
    share = np.linalg.norm(arm, axis=1) / reach_m
    return middle + arm * (1.0 + values["k"] * share**2)[:, None]
