"""Small rotations between matrices, vectors and quaternions (SciPy's conventions), over any leading axes."""

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def rotation_from_vector(vectors: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) rad, any frame."""
    q = quaternion_from_vector(vectors)
    out = np.empty((*q.shape[:-1], 3, 3))
    _matrices(q.reshape(-1, 4), out.reshape(-1, 3, 3))
    return out


@numba.njit(cache=True)
def _matrices(q, R):  # type: ignore[no-untyped-def]
    for n in range(len(q)):
        x, y, z, w = q[n, 0], q[n, 1], q[n, 2], q[n, 3]
        R[n, 0, 0], R[n, 0, 1], R[n, 0, 2] = x * x - y * y - z * z + w * w, 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)
        R[n, 1, 0], R[n, 1, 1], R[n, 1, 2] = 2.0 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2.0 * (y * z - x * w)
        R[n, 2, 0], R[n, 2, 1], R[n, 2, 2] = 2.0 * (x * z - y * w), 2.0 * (y * z + x * w), -x * x - y * y + z * z + w * w


def rotation_vector(R: Array) -> Array:
    """Rotation vectors (n, 3) rad of ``R`` (n, 3, 3), orthonormal, in the frame that they map to."""
    out = np.empty((len(R), 3))
    _rotation_vector(np.ascontiguousarray(R, dtype=np.float64).reshape(-1, 9), out)
    return out


@numba.njit(cache=True)
def _rotation_vector(R, out):  # type: ignore[no-untyped-def]
    """By way of the quaternion, from the largest of its four numbers [Shepperd 1978]."""
    q = np.empty(4)
    for n in range(len(R)):
        M = R[n]
        trace, largest = M[0] + M[4] + M[8], 3
        most = trace
        for i in range(3):
            if M[4 * i] > most:
                most, largest = M[4 * i], i
        if largest == 3:
            q[0], q[1], q[2], q[3] = M[7] - M[5], M[2] - M[6], M[3] - M[1], 1.0 + trace
        else:
            i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
            q[i], q[3] = 1.0 - trace + 2.0 * M[4 * i], M[3 * k + j] - M[3 * j + k]
            q[j], q[k] = M[3 * j + i] + M[3 * i + j], M[3 * k + i] + M[3 * i + k]
        if q[3] < 0.0:
            q[:] = -q
        sine, size = np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2), np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
        factor = 2.0 / size if sine <= 1e-9 * size else 2.0 * np.arctan2(sine, q[3]) / sine
        for i in range(3):
            out[n, i] = factor * q[i]


def quaternion(R: Array) -> Array:
    """Quaternions (..., 4), scalar last, of matrices ``R`` (..., 3, 3) between any frames."""
    return np.asarray(Rotation.from_matrix(R).as_quat(), dtype=np.float64)


def quaternion_from_vector(vectors: Array) -> Array:
    """Quaternions (..., 4), scalar last, of rotation vectors (..., 3) rad, any frame."""
    out = np.empty((*vectors.shape[:-1], 4))
    _quaternion_from_vector(np.ascontiguousarray(vectors, dtype=np.float64).reshape(-1, 3), out.reshape(-1, 4))
    return out


@numba.njit(cache=True)
def _quaternion_from_vector(vectors, out):  # type: ignore[no-untyped-def]
    """``v sin(a/2) / a, cos(a/2)``, of small angles a by the sine's series, as SciPy does."""
    for n in range(len(vectors)):
        square = vectors[n, 0] ** 2 + vectors[n, 1] ** 2 + vectors[n, 2] ** 2
        angle = np.sqrt(square)
        factor = 0.5 - square / 48.0 + square * square / 3840.0 if angle <= 1e-3 else np.sin(0.5 * angle) / angle
        for i in range(3):
            out[n, i] = factor * vectors[n, i]
        out[n, 3] = np.cos(0.5 * angle)
