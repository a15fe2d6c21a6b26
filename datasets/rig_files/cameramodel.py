"""mrcal's ``.cameramodel``: a table in Python's notation; ``extrinsics`` take the reference to the camera (Rodrigues' vector, m)."""

import ast
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.names import file_name
from datasets.rig_files.matrices import LARGEST_BYTES
from datasets.vocabulary.camera import LARGEST_SIDE_PX, HsvCamera, Intrinsics

LARGEST_MODEL_BYTES = 16 * LARGEST_BYTES
"""Models may hold what they were made from."""
MODELS = {"LENSMODEL_PINHOLE": 0, "LENSMODEL_OPENCV4": 4, "LENSMODEL_OPENCV5": 5, "LENSMODEL_OPENCV8": 8, "LENSMODEL_OPENCV12": 12}
"""Lens models and how many numbers of distortion they have."""


def read_cameramodel(path: Path) -> HsvCamera:
    """The camera of such a file.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    table = _table(path)
    model = table.get("lensmodel")
    if model not in MODELS:
        raise InputError(f"{path}: expected lensmodel {' or '.join(MODELS)}, got {str(model)[:60]!r}; convert it first.")
    numbers = _numbers(path, table, "intrinsics", 4 + MODELS[model])
    width, height = (int(n) for n in _numbers(path, table, "imagersize", 2))
    if not (1 <= width <= LARGEST_SIDE_PX and 1 <= height <= LARGEST_SIDE_PX and min(numbers[:2]) > 0):
        raise InputError(f"{path}: expected a picture's size and focal lengths above 0, got {width} x {height} px, {numbers[:2]}.")
    pose = _numbers(path, table, "extrinsics", 6)
    fx, fy, cx, cy = numbers[:4]
    lens = Intrinsics(width, height, fx, fy, cx, cy, five(numbers[4:], path))
    return HsvCamera(file_name(path.stem), lens, Rotation.from_rotvec(pose[:3]).as_matrix(), np.array(pose[3:]))


def five(distortion: list[float], path: Path) -> tuple[float, float, float, float, float]:
    """OpenCV's distortion as k1, k2, p1, p2, k3; further terms must be none.

    Raises
    ------
    InputError
        Where one is not.
    """
    if any(distortion[5:]):
        raise InputError(
            f"{path}: expected distortion of at most five terms (k1, k2, p1, p2, k3), got {len(distortion)}; calibrate without "
            "the rational, prism and tilted models."
        )
    k1, k2, p1, p2, k3 = (*distortion[:5], *(0.0 for _ in range(5 - len(distortion[:5]))))
    return k1, k2, p1, p2, k3


def _table(path: Path) -> dict[Any, Any]:
    try:
        if path.stat().st_size > LARGEST_MODEL_BYTES:
            raise InputError(f"{path}: expected a camera model of at most {LARGEST_MODEL_BYTES} bytes, got {path.stat().st_size}.")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            table = ast.literal_eval(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as error:
        raise InputError(f"{path}: expected a camera model of mrcal, got another file ({type(error).__name__}).") from None
    if not isinstance(table, dict):
        raise InputError(f"{path}: expected a camera model of mrcal (a table), got {type(table).__name__}.")
    return table


def _numbers(path: Path, table: dict[Any, Any], key: str, count: int) -> list[float]:
    """So many finite numbers under ``key``."""
    values = table.get(key)
    if not (isinstance(values, list | tuple) and len(values) == count and all(map(_is_number, values))):
        raise InputError(f"{path}: expected {key} of {count} numbers, got {str(values)[:60]}.")
    return [float(v) for v in values]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e100
