"""A calibration as a document: ``calibration.json``, in a folder of its own. See ``docs/format.md``."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.covariances import check_covariance
from datasets.errors import InputError
from datasets.json_documents import Document, read_document, write_document
from datasets.observation_files import camera_entry, camera_of_entry
from datasets.plausibility import check_camera
from datasets.rounded_rotations import nearest_rotation
from datasets.vocabulary.calibration import Calibration, CalibrationFit, CrossValidation, parameter_names
from datasets.vocabulary.camera import HsvCamera

FILE = "calibration.json"
KIND = "calibration"
Array = NDArray[np.float64]


def write_calibration(calibration: Calibration, path: Path) -> None:
    """Write a calibration; the same one gives the same bytes."""
    names = parameter_names(len(calibration.cameras)) if calibration.cameras else ()
    content: Document = {
        "cameras": [camera_entry(camera) for camera in calibration.cameras],
        "parameters": names,
        "covariance": calibration.covariance,
        "fit": None if calibration.fit is None else _fit_entry(calibration.fit),
        "board": calibration.board,
        "gravity_world": calibration.gravity_world,
        "gravity_covariance": calibration.gravity_covariance,
        "notes": calibration.notes,
    }
    write_document(path, KIND, content)


def read_calibration(path: Path) -> Calibration:
    """Read a calibration from its file or its folder.

    Raises
    ------
    InputError
        Naming the file, the place in it, what was expected and what came.
    """
    path = path / FILE if path.is_dir() else path
    document = read_document(path, KIND)
    cameras = tuple(_camera(path, c, entry) for c, entry in enumerate(document["cameras"]))
    names = parameter_names(len(cameras)) if cameras else ()
    if tuple(document["parameters"]) != names:
        raise InputError(f"{path}: at $.parameters: expected the {len(names)} names of {len(cameras)} cameras in order, got others.")
    return Calibration(
        cameras=cameras,
        covariance=_covariance(path, "covariance", document["covariance"], len(names)),
        fit=None if document["fit"] is None else _fit(document["fit"]),
        board=document["board"],
        gravity_world=None if document["gravity_world"] is None else np.array(document["gravity_world"], dtype=np.float64),
        gravity_covariance=_covariance(path, "gravity_covariance", document["gravity_covariance"], 3),
        notes=tuple(document["notes"]),
    )


def _camera(path: Path, number: int, entry: Document) -> HsvCamera:
    camera = camera_of_entry(entry)
    rounded = replace(camera, R_cam_world=nearest_rotation(camera.R_cam_world))
    check_camera(rounded, f"{path}: at $.cameras[{number}]")
    return rounded


def _covariance(path: Path, key: str, rows: Any, size: int) -> Array | None:
    """A symmetric matrix without negative variances; ``None`` where there is none."""
    if rows is None:
        return None
    if len(rows) != size or any(len(row) != size for row in rows):
        raise InputError(f"{path}: at $.{key}: expected {size} rows of {size} numbers, got another shape.")
    matrix = np.array(rows, dtype=np.float64)
    check_covariance(matrix, f"{path}: at $.{key}")
    return matrix


def _fit_entry(fit: CalibrationFit) -> Document:
    check = fit.cross_validation
    return {**vars(fit), "cross_validation": None if check is None else vars(check)}


def _fit(entry: Document) -> CalibrationFit:
    check = entry["cross_validation"]
    return CalibrationFit(**{**entry, "cross_validation": None if check is None else CrossValidation(**check)})
