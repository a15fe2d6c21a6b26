"""Small rotations between matrices, vectors and quaternions (SciPy's conventions), over any leading axes."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def rotation_from_vector(vectors: Array) -> Array:
    """Rotation matrices (n, 3, 3) of rotation vectors (n, 3) rad."""
    return np.asarray(Rotation.from_rotvec(vectors).as_matrix(), dtype=np.float64)


def rotation_vector(R: Array) -> Array:
    """Rotation vectors (n, 3) rad of matrices (n, 3, 3)."""
    return np.asarray(Rotation.from_matrix(R).as_rotvec(), dtype=np.float64)


def quaternion(R: Array) -> Array:
    """Quaternions (..., 4), scalar last, of matrices (..., 3, 3)."""
    return np.asarray(Rotation.from_matrix(R).as_quat(), dtype=np.float64)


def quaternion_from_vector(vectors: Array) -> Array:
    """Quaternions (n, 4), scalar last, of rotation vectors (n, 3) rad."""
    return np.asarray(Rotation.from_rotvec(vectors).as_quat(), dtype=np.float64)
