"""The focal length (principal distance) is not the stated one.

``fx`` and ``fy`` are ``1 + relative`` times the stated ones [Hartley and Zisserman, Multiple View Geometry (2004), ch. 6].

``f = (1 + relative) f_stated``. Valid for any camera.
"""

from dataclasses import replace

from datasets.vocabulary.camera import Intrinsics
from synth.effects.links import Values


def change(camera: Intrinsics, values: Values) -> Intrinsics:
    """The true camera."""
    factor = 1 + values["relative"]
    return replace(camera, fx_px=camera.fx_px * factor, fy_px=camera.fy_px * factor)
