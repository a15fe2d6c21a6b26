"""A camera's calibration and the direction of gravity in files of their own, TOML or JSON, with the keys of ``observation.json``.

A calibration has ``intrinsics`` (``width_px``, ``height_px``, ``fx_px``, ``fy_px``; ``cx_px``, ``cy_px``, ``distortion`` where known) or
these keys alone, and ``R_cam_world``, ``t_cam_world`` where the camera is not the first. A gravity file has ``gravity_world`` (m/s2). A
calibration of ``tumble calibrate`` (its folder or its file) and an observation serve as either.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.calibration_files import FILE as CALIBRATION_FILE
from datasets.calibration_files import KIND, read_calibration
from datasets.errors import InputError
from datasets.json_documents import parsed_json
from datasets.observation import Observation
from datasets.observation_files import FILE, camera_of_entry, read_observation
from datasets.schema_errors import first_violation
from datasets.toml_text import read_toml
from datasets.vocabulary.calibration import Calibration
from datasets.vocabulary.camera import HsvCamera

BESIDE = ("format", "schema_version", "sha256", "name", "recording")
POSED = ("R_cam_world", "t_cam_world")


def read_camera(path: Path, number: int = 0) -> HsvCamera:
    """The camera of a calibration, or camera ``number`` of an observation or a rig (its last one where it has fewer).

    Raises
    ------
    InputError
        Naming the file, the place in it, what was expected and what came.
    """
    told = calibration_at(path) or observation_at(path)
    if told is not None:
        if not told.cameras:
            raise InputError(f"{path}: expected a calibration with a camera, got one of gravity alone.")
        number = min(number, len(told.cameras) - 1)
        return told.camera(number) if isinstance(told, Calibration) else told.cameras[number]
    table = _table(path)
    alone = {key: table[key] for key in table if key not in (*BESIDE, *POSED)}
    entry = {
        "name": "hsv",
        "intrinsics": table.get("intrinsics", alone),
        "R_cam_world": table.get("R_cam_world", np.eye(3).tolist()),
        "t_cam_world": table.get("t_cam_world", [0.0, 0.0, 0.0]),
        "recording": {"kind": "outlines", "file": "none.npz"},
        **({key: alone[key] for key in alone if key != "intrinsics"} if "intrinsics" in table else {}),
    }
    _check(path, {"cameras": [entry]})
    return camera_of_entry(entry)


def states_principal_point(path: Path, number: int = 0) -> bool:
    """Whether a file that :func:`read_camera` takes states ``cx_px`` and ``cy_px``, which are the picture's centre where it does not."""
    if calibration_at(path) is not None:
        return True
    table = _table(path / FILE if path.is_dir() else path)
    cameras = table.get("cameras", [table])  # of an observation, else one alone
    entry = cameras[min(number, len(cameras) - 1)]
    return {"cx_px", "cy_px"} <= set(entry.get("intrinsics", entry))


def read_gravity(path: Path) -> tuple[Float[NDArray[np.float64], "3"], Float[NDArray[np.float64], "3 3"] | None]:
    """The acceleration of gravity (3,) m/s2 in the first camera's frame, and its covariance (3, 3) where there is one.

    Raises
    ------
    InputError
        Naming the file, the place in it, what was expected and what came.
    """
    told = calibration_at(path) or observation_at(path)
    if told is not None:
        if told.gravity_world is None:
            raise InputError(f"{path}: expected a calibration with gravity, got one of cameras alone.")
        return told.gravity_world, told.gravity_covariance
    table = _table(path)
    _check(path, {"gravity_world": table.get("gravity_world")})
    return np.array(table["gravity_world"], dtype=np.float64), None


def calibration_at(path: Path) -> Calibration | None:
    """The calibration whose folder or document ``path`` is; ``None`` where it is another file."""
    if path.is_dir():
        return read_calibration(path) if (path / CALIBRATION_FILE).exists() else None
    if path.suffix.lower() != ".json":
        return None
    document = parsed_json(path)
    ours = isinstance(document, dict) and document.get("format") == f"tumble {KIND}"
    return read_calibration(path) if ours else None


def observation_at(path: Path) -> Observation | None:
    """The observation whose folder or ``observation.json`` ``path`` is; ``None`` where it is another file."""
    if path.name == FILE:
        return read_observation(path.parent)
    return read_observation(path) if path.is_dir() else None


def _table(path: Path) -> dict[str, Any]:
    table = parsed_json(path) if path.suffix.lower() == ".json" else read_toml(path)
    if not isinstance(table, dict):
        raise InputError(f"{path}: expected a table of keys and values, got another kind of JSON.")
    return table


def _check(path: Path, part: dict[str, Any]) -> None:
    """Hold a part of an observation against the schema, by putting it into one that is valid."""
    nothing = {"kind": "outlines", "file": "none.npz"}
    whole = {
        **{"format": "tumble observation", "schema_version": 1, "name": "none", "gravity_world": [0.0, 0.0, 0.0], "cameras": []},
        **{"clock": {"times_s": [0.0], "exposure_s": 0.0}, "views": {"cameras": [], "recording": nothing}},
        **part,
    }
    if not whole["cameras"]:
        size = {"width_px": 1, "height_px": 1, "fx_px": 1.0, "fy_px": 1.0}
        pose = {"R_cam_world": np.eye(3).tolist(), "t_cam_world": [0.0, 0.0, 0.0]}
        whole["cameras"] = [{"name": "none", "intrinsics": size, "recording": nothing, **pose}]
    violation = first_violation(whole, "observation")
    if violation is not None:
        raise InputError(f"{path}: {violation.replace('$.cameras[0].', '$.')}")
