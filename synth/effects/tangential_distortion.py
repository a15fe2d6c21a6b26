"""The lens elements are not centred, on top of the stated distortion.

``x_d = x + 2 p1 x y + p2 (r² + 2 x²)``, ``y_d = y + p1 (r² + 2 y²) + 2 p2 x y`` in normalised coordinates [Brown, Photogrammetric
Engineering 37 (1971) 855]; valid where the map is one to one.
"""

from dataclasses import replace

from datasets.vocabulary.camera import Intrinsics
from synth.effects.links import Values


def change(camera: Intrinsics, values: Values) -> Intrinsics:
    """The true camera."""
    k1, k2, p1, p2, k3 = camera.distortion
    return replace(camera, distortion=(k1, k2, p1 + values["p1"], p2 + values["p2"], k3))
