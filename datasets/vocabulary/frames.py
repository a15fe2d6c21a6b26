"""Frames of reference and rotations.

* **camera**: as in OpenCV, x right, y down, z forward. Pixel centres lie on integers.
* **world**: the frame of the first HSV camera.
* **particle**: the frame in which the calibrated views of the particle are given; arbitrary.
* **body**: origin at the centre of mass, axes along the principal axes of inertia in ascending order
  of the principal moments, right-handed, signed as :func:`datasets.vocabulary.body.signed_axes` says.

``R_a_b, t_a_b`` map coordinates in ``b`` to coordinates in ``a``: ``x_a = R_a_b @ x_b + t_a_b``.
Quaternions are scalar-last and unit, as in :class:`scipy.spatial.transform.Rotation`.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


def is_rotation(R: NDArray[np.float64], *, tolerance: float = 1e-6) -> bool:
    """Whether ``R`` (3, 3) is orthonormal with determinant +1 within ``tolerance``."""
    if R.shape != (3, 3) or not np.abs(R).max() <= 1 + tolerance:
        return False
    return bool(np.abs(R @ R.T - np.eye(3)).max() < tolerance and np.linalg.det(R) > 0)


def geodesic_angle(
    R_a: Float[NDArray[np.float64], "*#batch 3 3"], R_b: Float[NDArray[np.float64], "*#batch 3 3"]
) -> Float[NDArray[np.float64], "*#batch"]:
    """Angle in rad, in [0, pi], of the rotation that takes ``R_a`` to ``R_b``."""
    relative = np.swapaxes(R_a, -1, -2) @ R_b
    return np.asarray(Rotation.from_matrix(relative).magnitude(), dtype=np.float64)
