"""A solution of the equations of motion on both sides of time zero, known at any instant within its span."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DenseSolution:
    """Dense output of an integration ``forward`` and ``backward`` from time zero, wanted between ``earliest_s`` and ``latest_s``."""

    earliest_s: float
    latest_s: float
    forward: Any
    backward: Any

    def __call__(self, t: Array) -> Array:
        """States (n, s) at times (n,) s.

        Raises
        ------
        ValueError
            Where a time lies outside the span that was integrated.
        """
        if t.size and (t.min() < self.earliest_s or t.max() > self.latest_s):
            span = f"{self.earliest_s:.6g} s to {self.latest_s:.6g} s"
            raise ValueError(f"the flight is known from {span}; asked for {t.min():.6g} s to {t.max():.6g} s")
        return np.asarray(np.where(t >= 0, self.forward(np.maximum(t, 0)), self.backward(np.minimum(t, 0))).T)
