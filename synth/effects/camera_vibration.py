"""The camera rings on its post and takes the picture along.

``shift = sine sin(2 pi f t) + cosine cos(2 pi f t)``, px, ``t`` the time stamp counted from the sequence's first frame. Small rotations of
a camera with a long lens are shifts of the picture; valid for shifts well below the focal length in px. Within an exposure the picture
moves on, wherever the exposure is realised.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Sway, Values


def sway(times_s: NDArray[np.float64], values: Values) -> Sway:
    """The picture's shift at instants (n,) s."""
    phase = 2 * np.pi * values["frequency"] * times_s[:, None]
    sine = np.array([values["sine_x"], values["sine_y"]])
    cosine = np.array([values["cosine_x"], values["cosine_y"]])
    return Sway(np.ones(len(times_s)), np.sin(phase) * sine + np.cos(phase) * cosine)
