"""The lens bends lines radially, on top of the stated distortion.

``x_d = x (1 + k1 r² + k2 r⁴)`` in normalised coordinates [Brown, Photogrammetric Engineering 37 (1971) 855]. Realised in the true camera
through which the exact outline is projected; valid where the map is one to one.
"""

from dataclasses import replace

from datasets.vocabulary.camera import Intrinsics
from synth.effects.links import Values


def change(camera: Intrinsics, values: Values) -> Intrinsics:
    """The true camera."""
    k1, k2, p1, p2, k3 = camera.distortion
    return replace(camera, distortion=(k1 + values["k1"], k2 + values["k2"], p1, p2, k3))
