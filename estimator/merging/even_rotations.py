"""Rotations spread evenly over all orientations: a super-Fibonacci spiral on the unit quaternions [Alexa 2022, CVPR, algorithm 1]."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

PHI, PSI = np.sqrt(2.0), 1.533751168755204288118041
"""The constants of the paper: psi⁴ = psi + 4."""


def even_rotations(count: int) -> Float[NDArray[np.float64], "count 3 3"]:
    """``count`` rotation matrices; the same ones for the same number."""
    s = np.arange(count) + 0.5
    share = s / count
    r, R = np.sqrt(share), np.sqrt(1.0 - share)
    alpha, beta = 2.0 * np.pi * s / PHI, 2.0 * np.pi * s / PSI
    quaternions = np.column_stack([r * np.sin(alpha), r * np.cos(alpha), R * np.sin(beta), R * np.cos(beta)])
    return np.asarray(Rotation.from_quat(quaternions).as_matrix())
