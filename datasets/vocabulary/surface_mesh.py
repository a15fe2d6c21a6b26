"""A closed surface of triangles."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray


@dataclass(frozen=True)
class SurfaceMesh:
    """``vertices`` (v, 3) m in the particle frame, ``faces`` (f, 3), outward."""

    vertices: Float[NDArray[np.float64], "v 3"]
    faces: Int[NDArray[np.int64], "f 3"]
