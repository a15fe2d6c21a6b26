"""Light leaks through facets of a transparent particle that lie along the line of sight.

``delta = -loss f / (1 + f)``; ``f(u)`` is the length of outline whose normals lie within ``FLATNESS_HALF_ANGLE_DEG`` of ``u``, over 0.349
times the outline's mean radius (perimeter over 2 pi): 1 on a circle, large on a long flat stretch, which is a facet seen edge on. Of all
points within ``FLATNESS_REACH_PX`` along the outline the largest ``f`` counts: where two such facets meet, their corner recedes with them
and does not stay behind as a spike. Normals are those of the outline at the scale of a pixel. An approximation for convex facetted bodies
before a back light.

Valid for losses well below the outline.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.effects import FLATNESS_HALF_ANGLE_DEG, FLATNESS_REACH_PX
from synth.effects.displacement import STEP_PX, displaced
from synth.effects.links import Values

Array = NDArray[np.float64]


def reshape(outline_px: Array, _camera: Intrinsics, values: Values) -> Array:
    """The outline that is drawn."""

    def delta(_points: Array, normals: Array) -> Array:
        f = maximum_filter1d(flatness(normals), size=2 * round(FLATNESS_REACH_PX / STEP_PX) + 1, mode="wrap")
        return np.asarray(-values["loss"] * f / (1 + f))

    return displaced(outline_px, delta)


def flatness(normals: Array) -> Array:
    """``f`` of each of the unit normals (n, 2) at points that are equally spaced along an outline."""
    near = normals @ normals.T >= np.cos(np.deg2rad(FLATNESS_HALF_ANGLE_DEG))
    mean_radius = len(normals) * STEP_PX / (2 * np.pi)
    return np.asarray(near.sum(axis=1) * STEP_PX / (2 * np.deg2rad(FLATNESS_HALF_ANGLE_DEG) * mean_radius))
