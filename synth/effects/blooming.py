"""Bright background spills over the rim of the particle.

``delta = -loss (1 - r² / R²)``, ``r`` the distance from the picture's centre, ``R`` half its diagonal: most where the back-light is
brightest [EMVA Standard 1288 (2021); charge spilling from saturated pixels]. Each point of the outline recedes along its own normal.

Valid for losses well below the outline.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from synth.effects.displacement import displaced
from synth.effects.links import Values

Array = NDArray[np.float64]


def reshape(outline_px: Array, camera: Intrinsics, values: Values) -> Array:
    """The outline that is drawn."""
    size = np.array([camera.width_px, camera.height_px])
    centre, reach2 = (size - 1) / 2, float((size**2).sum()) / 4

    def delta(points: Array, _normals: Array) -> Array:
        return np.asarray(-values["loss"] * (1 - ((points - centre) ** 2).sum(axis=1) / reach2))

    return displaced(outline_px, delta)
