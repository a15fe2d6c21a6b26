"""Pixels are not as square as stated.

``v = fy (1 + relative) y / z + cy`` [Hartley and Zisserman, Multiple View Geometry (2004), ch. 6].

Valid for perpendicular axes.
"""

from dataclasses import replace

from datasets.vocabulary.camera import Intrinsics
from synth.effects.links import Values


def change(camera: Intrinsics, values: Values) -> Intrinsics:
    """The true camera."""
    return replace(camera, fy_px=camera.fy_px * (1 + values["relative"]))
