"""Cameras as OpenCV's samples and people write them with ``cv::FileStorage``, in YAML.

``camera_matrix``, ``K`` or ``M`` with ``distortion_coefficients``, ``dist_coeffs`` or ``D``, the picture's size as ``image_width`` and
``image_height``, a pose (world to camera) as ``R`` (3 x 3, or Rodrigues' vector) and ``T``. Several cameras have numbers behind these names
(``M1``, ``D1``, ``M2``, ``D2``); of a pair, plain ``R`` and ``T`` take the first camera's frame to the second's.
Matrices are found by their form, since OpenCV's own parser writes past its memory on some damaged files.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.names import file_name
from datasets.rig_files.cameramodel import five
from datasets.rig_files.matrices import MOST_CAMERAS, NUMBER, bytes_of
from datasets.vocabulary.camera import LARGEST_SIDE_PX, HsvCamera, Intrinsics

Array = NDArray[np.float64]
KINDS = {
    "K": ("camera_matrix", "cameramatrix", "k", "m"),
    "D": ("distortion_coefficients", "dist_coeffs", "distcoeffs", "d"),
    "R": ("r", "rvec"),
    "T": ("t", "tvec"),
}
"""Names of what a camera has, without their numbers, in lower case."""
MATRIX = re.compile(
    r"^([A-Za-z_][A-Za-z_0-9]{0,60}):(?: !!opencv-matrix)?\n"
    r" rows: ([0-9]{1,3})\n cols: ([0-9]{1,3})\n(?: dt: [^\n]{1,9}\n)? data: \[([^\]]*)\]",
    re.MULTILINE,
)
SIZES = re.compile(r": !!opencv-nd-matrix\n sizes: \[ ?([0-9]{1,3})(?:, ?([0-9]{1,3}))? ?\]")
SIDE = re.compile(r"^(image_width|image_height): ([0-9]{1,6})$", re.MULTILINE)
"""In text with single blanks."""


def read_opencv(path: Path, size: tuple[int, int] | None) -> list[HsvCamera]:
    """All cameras of a file; ``size`` (px) where the file does not say it.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    found, stated = _entries(path)
    numbers = sorted({number for kind, number in found if kind == "K"})
    if not 1 <= len(numbers) <= MOST_CAMERAS:
        raise InputError(f"{path}: expected a camera_matrix (or K, M; with numbers for several cameras), got none.")
    size = stated or size
    if size is None:
        raise InputError(f"{path}: expected image_width and image_height, got neither; state --size WIDTHxHEIGHT.")
    pair = len(numbers) == 2 and ("R", "") in found and ("T", "") in found
    names = [file_name(path.stem) + (f"_{number}" if number else "") for number in numbers]
    return [
        _camera(path, name, {kind: found[kind, key] for kind in KINDS for key in _keys(number, k, pair) if (kind, key) in found}, size)
        for k, (number, name) in enumerate(zip(numbers, names, strict=True))
    ]


def _keys(number: str, place: int, pair: bool) -> tuple[str, ...]:
    """Numbers of the entries of a camera; the pose of a pair is the second one's."""
    return (number, "") if pair and place == 1 else (number,)


def _entries(path: Path) -> tuple[dict[tuple[str, str], Array], tuple[int, int] | None]:
    """Arrays by kind and number, and the picture's size."""
    try:
        text = bytes_of(path).decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: expected YAML that OpenCV wrote, got binary data.") from None
    plain = "\n".join(line.rstrip() for line in re.sub(r"[ \t]+", " ", text).splitlines()) + "\n"
    plain = SIZES.sub(lambda found: f": !!opencv-matrix\n rows: {found[1]}\n cols: {found[2] or 1}", plain)
    found: dict[tuple[str, str], Array] = {}
    for key, rows, columns, data in MATRIX.findall(plain):
        split = re.fullmatch(r"([A-Za-z_]+?)_?([0-9]{0,3})", key)
        kind = next((k for k, names in KINDS.items() if split is not None and split[1].lower() in names), None)
        if kind is not None and split is not None:
            found[kind, split[2]] = _matrix(path, key, (int(rows), int(columns)), data.split(","))
    sides = {key: int(number) for key, number in SIDE.findall(plain)}
    size = (sides.get("image_width", 0), sides.get("image_height", 0))
    return found, size if all(1 <= side <= LARGEST_SIDE_PX for side in size) else None


def _matrix(path: Path, key: str, shape: tuple[int, int], cells: list[str]) -> Array:
    """The numbers of a matrix."""
    numbers = [cell.strip() for cell in cells]
    wrong = next((number for number in numbers if NUMBER.fullmatch(number) is None), None)
    if wrong is not None or len(numbers) != shape[0] * shape[1]:
        came = f"{len(numbers)}" if wrong is None else repr(wrong[:40])
        raise InputError(f"{path}: {key}: expected {shape[0]} x {shape[1]} numbers, got {came}.")
    return np.array([float(number) for number in numbers]).reshape(shape)


def _camera(path: Path, name: str, found: dict[str, Array], size: tuple[int, int]) -> HsvCamera:
    K, D = found["K"], found.get("D", np.zeros(0)).ravel()
    R, T = found.get("R", np.eye(3)), found.get("T", np.zeros(3)).ravel()
    wanted = K.shape == (3, 3) and R.size in (3, 9) and T.shape == (3,) and D.size in (0, 4, 5, 8, 12, 14)
    sound = wanted and all(np.all(np.isfinite(a)) and np.abs(a).max(initial=0.0) < 1e100 for a in (K, D, R, T))
    if not (sound and K[0, 0] > 0 and K[1, 1] > 0 and abs(K[0, 1]) < 1e-9 * K[0, 0]):
        raise InputError(
            f"{path}: {name}: expected a 3 x 3 camera matrix without skew, 4 or 5 terms of distortion, R of 9 or 3 numbers and T of 3, "
            f"got shapes {K.shape}, {D.shape}, {R.shape}, {T.shape} or values that no camera has."
        )
    turn = R.reshape(3, 3) if R.size == 9 else Rotation.from_rotvec(R.ravel()).as_matrix()
    lens = Intrinsics(*size, float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]), distortion=five(D.tolist(), path))
    return HsvCamera(name, lens, turn, T)
