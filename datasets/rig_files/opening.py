"""Rigs of other programs' files, by the ends of their names, in metres, pixels from 0, and the first camera's frame."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from datasets.errors import InputError
from datasets.names import file_name
from datasets.plausibility import check_camera
from datasets.rig_files.cameramodel import read_cameramodel
from datasets.rig_files.handedness import in_front
from datasets.rig_files.matrices import Decomposed, decomposed, read_matrices
from datasets.rig_files.opencv_yaml import read_opencv
from datasets.rounded_rotations import nearest_rotation
from datasets.vocabulary.camera import HsvCamera

MATRICES = (".npy", ".mat", ".csv", ".txt")
OPENCV = (".yml", ".yaml")
MRCAL = (".cameramodel",)
SUFFIXES = (*OPENCV, *MRCAL, *MATRICES)
TOLD_SKEW_PX = 0.01
"""By how much (px) a dropped skew must move points to be told: outlines are known to some hundredths of a pixel at best."""
UNITS_M = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


@dataclass(frozen=True)
class Convention:
    """What such files do not say: the unit of lengths, a picture's ``size`` (px), and which number the first pixel's centre has."""

    unit: str = "m"
    size: tuple[int, int] | None = None
    first_pixel: int | None = None


def is_rig_file(path: Path) -> bool:
    """Whether a file is one of these by its name."""
    return path.suffix.lower() in SUFFIXES


def read_rig(paths: Sequence[Path], convention: Convention) -> tuple[tuple[HsvCamera, ...], tuple[str, ...]]:
    """All cameras of all files in the first one's frame, and what was assumed, in sentences.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    read = [(path, camera) for path in paths for camera in _cameras(path, convention)]
    names = [one.camera.name for _, one in read]
    if len(set(names)) < len(names):
        raise InputError(f"{paths[0]}: expected cameras with names of their own, got {', '.join(names)}.")
    scale = UNITS_M[convention.unit]
    shifted = [(path, _counted_from_zero(one.camera, _first(path, convention), scale)) for path, one in read]
    for path, camera in shifted:
        check_camera(camera, f"{path}: {camera.name}")
    cameras = _from_the_first([camera for _, camera in shifted])
    matrices = all(path.suffix.lower() in MATRICES for path in paths)  # poses of others were measured, in a world that is no mirror's
    cameras, turned = in_front(cameras, ", ".join(path.name for path in paths)) if matrices else (cameras, ())
    return cameras, (*_notes(paths, convention), *_skew([one for _, one in read]), *turned)


def _from_the_first(cameras: Sequence[HsvCamera]) -> tuple[HsvCamera, ...]:
    """The cameras in the frame of the first one."""
    R, t = cameras[0].R_cam_world, cameras[0].t_cam_world
    turns = [nearest_rotation(camera.R_cam_world @ R.T) for camera in cameras[1:]]
    others = [replace(c, R_cam_world=turn, t_cam_world=c.t_cam_world - turn @ t) for c, turn in zip(cameras[1:], turns, strict=True)]
    return (replace(cameras[0], R_cam_world=np.eye(3), t_cam_world=np.zeros(3)), *others)


def _skew(read: Sequence[Decomposed]) -> tuple[str, ...]:
    """What was dropped of leaning columns, where it can be seen."""
    farthest = max(one.farthest_px for one in read)
    if farthest < TOLD_SKEW_PX:
        return ()
    return (
        "Columns of pixels lean in these matrices (skew), which a sensor's do not: the nearest cameras without it show points up to "
        f"{farthest:.2g} px elsewhere, in the corners of pictures. Views are off by part of that: `tumble shape` says by how far.",
    )


def _cameras(path: Path, convention: Convention) -> list[Decomposed]:
    suffix = path.suffix.lower()
    if suffix in MRCAL:
        return [Decomposed(read_cameramodel(path), np.eye(2))]
    if suffix in OPENCV:
        return [Decomposed(camera, np.eye(2)) for camera in read_opencv(path, convention.size)]
    if suffix not in MATRICES:
        raise InputError(f"{path}: expected a file of cameras ({', '.join(SUFFIXES)}), got {path.suffix or 'a name without an ending'}.")
    if convention.size is None:
        raise InputError(f"{path}: expected --size WIDTHxHEIGHT beside matrices, which do not say how large pictures are; got none.")
    matrices, stem = read_matrices(path), file_name(path.stem)
    names = [stem] if len(matrices) == 1 else [f"{stem}_{k + 1}" for k in range(len(matrices))]
    pairs = zip(matrices, names, strict=True)
    return [decomposed(P, convention.size, f"{path}: matrix {k + 1}", name) for k, (P, name) in enumerate(pairs)]


def _first(path: Path, convention: Convention) -> int:
    """The number of the first pixel: as stated, else 1 for MATLAB's files and 0 for all others."""
    if convention.first_pixel is not None:
        return convention.first_pixel
    return 1 if path.suffix.lower() == ".mat" else 0


def _counted_from_zero(camera: HsvCamera, first: int, scale: float) -> HsvCamera:
    lens = camera.intrinsics
    moved = replace(lens, cx_px=lens.cx_px - first, cy_px=lens.cy_px - first)
    return replace(camera, intrinsics=moved, R_cam_world=nearest_rotation(camera.R_cam_world), t_cam_world=camera.t_cam_world * scale)


def _notes(paths: Sequence[Path], convention: Convention) -> tuple[str, ...]:
    firsts = sorted({_first(path, convention) for path in paths})
    said = "given" if convention.first_pixel is not None else "assumed: MATLAB's files count from 1, others from 0; state --first-pixel"
    return (
        f"Read from {', '.join(path.name for path in paths)}; lengths in {convention.unit} (--unit).",
        f"The first pixel's centre is {' or '.join(map(str, firsts))} there ({said}).",
        "Nobody stated how well these cameras are known: `tumble calibrate check` with pictures of a board says it.",
    )
