"""The sensor's rows are exposed one after the other.

The row ``y`` is exposed at ``t + line_time (y - (height - 1) / 2)`` [Ait-Aider, Andreff, Lavest and Martinet, ECCV (2006)]. Every point of
the surface is projected at the instant of the row in which it then appears.

``t(y) = t + line_time (y - (height - 1) / 2)``. Valid for an electronic shutter that all columns share.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from synth.effects.links import Values


def delays_s(y_px: NDArray[np.float64], camera: Intrinsics, values: Values) -> NDArray[np.float64]:
    """When rows (n,) px are exposed, s, against the frame's time."""
    return np.asarray(values["line_time"] * (y_px - (camera.height_px - 1) / 2))
