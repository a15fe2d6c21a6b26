"""The segmentation draws the outlines of the high-speed camera too wide or too tight.

``delta = offset``, realised as the parallel curve of the exact outline: all points within ``offset`` of the silhouette, or, for a negative
one, those farther than that from its outside [Forbes, PhD thesis, University of Cape Town (2007), ch. 4]. Valid below the outline's
smallest width.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from synth.effects.displacement import parallel_curve
from synth.effects.links import Values


def reshape(outline_px: NDArray[np.float64], _camera: Intrinsics, values: Values) -> NDArray[np.float64]:
    """The outline that is drawn."""
    return parallel_curve(outline_px, values["offset"])
