"""The optical axis meets the picture elsewhere than stated.

``(cx + dx, cy + dy)`` [Hartley and Zisserman, Multiple View Geometry (2004), ch. 6]. The centre of distortion moves with it.

``u = fx x / z + cx + dx``, and v likewise. Valid for any camera.
"""

from dataclasses import replace

from datasets.vocabulary.camera import Intrinsics
from synth.effects.links import Values


def change(camera: Intrinsics, values: Values) -> Intrinsics:
    """The true camera."""
    return replace(camera, cx_px=camera.cx_px + values["dx"], cy_px=camera.cy_px + values["dy"])
