"""Projection matrices P = K [R | t] of ideal cameras, and what becomes of eleven DLT coefficients.

``P ~ (u w, v w, w)`` of a point (x, y, z, 1). RQ decomposition with positive focal lengths [Hartley & Zisserman 2004, 6.2.4]. Eleven
coefficients L1..L11 of the direct linear transformation are P row by row with P34 = 1 [Abdel-Aziz & Karara 1971].
"""

import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.lib import format as npy
from numpy.typing import NDArray
from scipy.linalg import polar, rq

from datasets.errors import InputError
from datasets.rig_files.matlab import read_matlab
from datasets.vocabulary.camera import HsvCamera, Intrinsics

Array = NDArray[np.float64]

LARGEST_BYTES = 2**20
"""A calibration takes kilobytes."""
MOST_CAMERAS = 64
LARGEST_SKEW = 0.01
"""By which columns of pixels may lean (rad): a sensor's do not, and what a free fit finds of it is its error, 0.0026 of Oxford's turntable
upgraded to metric. The same turntable's projective matrices lean by 0.034: more than this is no camera of a metric world."""
DLT_COEFFICIENTS = 11
NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]{1,3})?")


@dataclass(frozen=True)
class Decomposed:
    """The nearest camera without skew; ``moved`` (2, 2) takes offsets from the principal point (px) of the matrix to the camera's."""

    camera: HsvCamera
    moved: Array

    @property
    def farthest_px(self) -> float:
        """By how much (px) pictures' corners differ between the matrix and the camera."""
        return float(np.linalg.norm(_corners(self.camera.intrinsics) @ (self.moved - np.eye(2)).T, axis=1).max())


def decomposed(P: Float[NDArray[np.float64], "3 4"], size: tuple[int, int], where: str, name: str) -> Decomposed:
    """The camera of a projection matrix; the scene lies where its depth is positive.

    Half of a small skew is a turn of the camera about its axis (polar decomposition of the upper left of K); the other half is dropped.

    Raises
    ------
    InputError
        Naming ``where``.
    """
    if not (np.all(np.isfinite(P)) and np.abs(P).max() < 1e100 and np.linalg.cond(P[:, :3]) < 1e12):
        raise InputError(f"{where}: expected a projection matrix of a pinhole camera, got one whose left 3 x 3 part has no inverse.")
    P = P / np.linalg.norm(P[2, :3]) * (1.0 if np.linalg.det(P[:, :3]) > 0 else -1.0)
    K, R = rq(P[:, :3])
    signs = np.diag(np.sign(np.diag(K)))
    K, R = K @ signs, signs @ R
    K = K / K[2, 2]
    t = np.linalg.solve(K, P[:, 3])
    lean = abs(K[0, 1] / K[1, 1])
    if not lean <= LARGEST_SKEW:
        raise InputError(
            f"{where}: expected columns of pixels that lean by at most {np.degrees(LARGEST_SKEW):.2g} degrees, got a matrix with "
            f"{np.degrees(np.arctan(lean)):.3g} ({lean * size[1]:.3g} px over the picture): no camera of a metric world. Upgrade a "
            "projective reconstruction to a metric one first, or fit with the skew held at zero (a modified DLT)."
        )
    turn, stretch = polar(K[:2, :2], side="left")
    Z = np.eye(3)
    Z[:2, :2] = turn
    lens = Intrinsics(size[0], size[1], float(stretch[0, 0]), float(stretch[1, 1]), float(K[0, 2]), float(K[1, 2]))
    moved = np.asarray(np.diag(np.diag(stretch)) @ np.linalg.inv(stretch), dtype=np.float64)
    return Decomposed(HsvCamera(name, lens, np.asarray(Z @ R, dtype=np.float64), Z @ t), moved)


def _corners(lens: Intrinsics) -> Array:
    """The corners (4, 2) px of a picture, from its principal point."""
    corners = [[u, v] for u in (-0.5, lens.width_px - 0.5) for v in (-0.5, lens.height_px - 0.5)]
    return np.array(corners) - [lens.cx_px, lens.cy_px]


def read_matrices(path: Path) -> Float[NDArray[np.float64], "camera 3 4"]:
    """All projection matrices of a ``.npy``, ``.mat``, ``.csv`` or ``.txt`` file.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    data = bytes_of(path)
    readers = {".npy": _npy, ".mat": _mat}
    try:
        values = readers.get(path.suffix.lower(), _table)(path, data)
    except InputError:
        raise
    except Exception as error:  # NumPy raises whatever its readers raise
        raise InputError(f"{path}: expected matrices, got a file that is damaged or of another kind ({error}).") from None
    return _as_matrices(path, values)


def bytes_of(path: Path) -> bytes:
    """The whole of a small file.

    Raises
    ------
    InputError
        Where it is missing or too large for a calibration.
    """
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(f"{path}: expected a calibration of at most {LARGEST_BYTES} bytes, got {path.stat().st_size}.")
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None


def _as_matrices(path: Path, values: Array) -> Array:
    """(n, 3, 4) of one matrix, several, rows below one another, or columns of DLT coefficients."""
    if values.ndim == 2 and values.shape[0] == DLT_COEFFICIENTS:
        ones = np.ones((values.shape[1], 1))
        values = np.concatenate([values.T, ones], axis=1).reshape(-1, 3, 4)
    elif values.ndim == 2 and values.shape[1] == 4 and values.shape[0] % 3 == 0 and len(values):
        values = values.reshape(-1, 3, 4)
    if values.ndim != 3 or values.shape[1:] != (3, 4) or not 1 <= len(values) <= MOST_CAMERAS:
        raise InputError(
            f"{path}: expected 3 x 4 matrices (one, below one another, or n x 3 x 4) or {DLT_COEFFICIENTS} rows of DLT coefficients, "
            f"a column for each camera, got numbers of shape {' x '.join(map(str, values.shape))}."
        )
    return values


def _npy(path: Path, data: bytes) -> Array:
    stream = io.BytesIO(data)
    if npy.read_magic(stream) != (1, 0):
        raise InputError(f"{path}: expected an array in version 1 of NumPy's format, got another.")
    shape, _, dtype = npy.read_array_header_1_0(stream)
    if dtype.kind not in "fiu" or len(data) - stream.tell() != int(np.prod(shape, dtype=object)) * dtype.itemsize:
        raise InputError(f"{path}: expected an array of numbers, got {dtype} of shape {shape} in {len(data)} bytes.")
    return np.asarray(npy.read_array(io.BytesIO(data), allow_pickle=False), dtype=np.float64)


def _mat(path: Path, data: bytes) -> Array:
    """All variables of 3 x 4 (x n) numbers in the order of the numbers in their names, a cell array of 3 x 4, or one of 11 x n."""
    found = read_matlab(path, data)
    chosen = [name for name in sorted(found, key=_in_order) if all(a.shape[:2] == (3, 4) for a in found[name])]
    columns = [arrays[0] for arrays in found.values() if len(arrays) == 1 and arrays[0].ndim == 2 and len(arrays[0]) == DLT_COEFFICIENTS]
    if not chosen and not columns:
        names = ", ".join(found) or "no numbers"
        raise InputError(f"{path}: expected variables of 3 x 4 (x n) or 11 x n numbers, or a cell array of 3 x 4, got {names[:200]}.")
    if not chosen:
        return columns[0]
    return np.concatenate([np.moveaxis(a.reshape(3, 4, -1), 2, 0) for name in chosen for a in found[name]])


def _in_order(name: str) -> tuple[str, int]:
    found = re.search(r"[0-9]{1,9}", name)
    return (re.sub(r"[0-9]+.*", "", name), int(found[0]) if found else 0)


def _table(path: Path, data: bytes) -> Array:
    """Numbers with commas, semicolons or blanks between them; lines that begin with # are comments."""
    try:
        lines = [re.split(r"[,;\s]+", line.strip().strip(",;")) for line in data.decode("utf-8").splitlines()]
    except UnicodeDecodeError:
        raise InputError(f"{path}: expected a table of numbers in UTF-8, got binary data.") from None
    rows = [line for line in lines if line != [""] and not line[0].startswith("#")]
    wrong = next((cell for row in rows for cell in row if NUMBER.fullmatch(cell) is None), None)
    if wrong is not None or not rows or len({len(row) for row in rows}) > 1:
        came = (wrong or "rows of different length")[:40] if rows else "none"
        raise InputError(f"{path}: expected rows of as many numbers each, got {came!r}.")
    return np.array([[float(cell) for cell in row] for row in rows])
