"""``tumble calibrate gravity``: pictures of a plumb line, points of it, or a level's readings -> gravity in the first camera's frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.camera_files import calibration_at, read_camera
from datasets.errors import InputError
from datasets.plumb_files import read_plumb_points
from datasets.vocabulary.calibration import LENS, POSE, Calibration
from datasets.vocabulary.camera import HsvCamera
from estimator.calibration.plumb_line import Thread, gravity_direction, thread_in
from tumble.calibrating.pictures import Target, targets_in

STEEPEST_DEG = 89.0
"""Of a level's readings: pitch and roll are the same turn where a camera looks straight up."""


@dataclass(frozen=True)
class Level:
    """What a level on a camera reads: ``pitch_deg`` that it looks up, ``roll_deg`` that its right side is low, ``sigma_deg`` of both."""

    words: str
    pitch_deg: float
    roll_deg: float
    sigma_deg: float


def level_of(words: str) -> Level:
    """A level's readings as they are typed, ``PITCH,ROLL±SIGMA`` in degrees.

    Raises
    ------
    InputError
        With what was expected and what was given.
    """
    readings, _, sure = words.replace("+-", "±").partition("±")
    try:
        pitch, roll = (float(each) for each in readings.split(","))
        sigma = float(sure)
    except ValueError:
        pitch = roll = sigma = float("nan")
    if not (abs(pitch) <= STEEPEST_DEG and abs(roll) <= STEEPEST_DEG and 0.0 < sigma <= STEEPEST_DEG):
        form = f"PITCH,ROLL±SIGMA in degrees up to {STEEPEST_DEG:g}, as in 0.4,-0.1±0.05"
        raise InputError(f"--level {words}: expected {form}, got another text.")
    return Level(words, pitch, roll, sigma)


def calibration_of(path: Path) -> Calibration:
    """A calibration, or the camera of another file as one without covariance.

    Raises
    ------
    InputError
        Naming the file; also where it has no camera.
    """
    made = calibration_at(path) or Calibration(cameras=(read_camera(path),))
    if not made.cameras:
        raise InputError(f"{path}: expected a calibration with a camera, got one of gravity alone.")
    return made


def paired(paths: Sequence[Path], cameras: Sequence[HsvCamera], what: str) -> list[tuple[int, list[Target]]]:
    """Pictures by camera: all of them where there is one camera, else a folder or file for each.

    Raises
    ------
    InputError
        Where numbers or sizes do not fit.
    """
    if len(cameras) == 1:
        pairs = [(0, targets_in(paths))]
    elif len(paths) == len(cameras):
        pairs = [(c, targets_in([path])) for c, path in enumerate(paths)]
    else:
        raise InputError(f"{paths[0]}: expected {what} for each of the {len(cameras)} cameras, in their order, got {len(paths)}.")
    for c, targets in pairs:
        lens = cameras[c].intrinsics
        for target in targets:
            height, width = target.grey.shape
            if (width, height) != (lens.width_px, lens.height_px):
                raise InputError(f"{target.name}: expected {lens.width_px} x {lens.height_px} px as calibrated, got {width} x {height}.")
    return pairs


def calibrate_gravity(paths: Sequence[Path], camera: Path, strength_ms2: float) -> Calibration:
    """Gravity in the first camera's frame.

    Raises
    ------
    InputError
        Naming the picture or file, what was expected and what came.
    """
    known = calibration_of(camera)
    threads = _clicked(paths[0], known) if paths[0].suffix.lower() == ".csv" else _seen(paths, known)
    turns = [_turn_covariance(known, c) for c in range(len(known.cameras))]
    down = gravity_direction(threads, known.cameras, turns)
    notes = [
        f"From {len(threads)} views of a plumb line, taken to hang towards the lower half of {threads[0].name}; "
        f"strength {strength_ms2:g} m/s2."
    ]
    if down.factor > 1:
        notes.append(f"Views of the plumb line differ by more than their points explain: the uncertainty is widened by {down.factor:.2g}.")
    return Calibration(
        gravity_world=strength_ms2 * down.direction_world, gravity_covariance=strength_ms2**2 * down.covariance, notes=tuple(notes)
    )


def levelled(level: Level, strength_ms2: float) -> Calibration:
    """Gravity in the frame of a camera on which a level was read."""
    pitch, roll = np.radians([level.pitch_deg, level.roll_deg])
    down = np.array([np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll), -np.sin(pitch)])
    across = np.eye(3) - np.outer(down, down)
    return Calibration(
        gravity_world=strength_ms2 * down,
        gravity_covariance=(strength_ms2 * np.radians(level.sigma_deg)) ** 2 * across,
        notes=(f"From a level on the first camera: {level.words}; strength {strength_ms2:g} m/s2.",),
    )


def _clicked(path: Path, known: Calibration) -> list[Thread]:
    found = read_plumb_points(path)
    for camera, line in found:
        if camera >= len(known.cameras):
            raise InputError(f"{path}: line {line}: expected cameras 1 to {len(known.cameras)}, got {camera + 1}.")
    if not found:
        raise InputError(f"{path}: expected points of a plumb line, got none.")
    return [Thread(camera, points, f"{path}, camera {camera + 1}, line {line}") for (camera, line), points in found.items()]


def _seen(paths: Sequence[Path], known: Calibration) -> list[Thread]:
    return [
        thread_in(target.grey, c, target.name)
        for c, targets in paired(paths, known.cameras, "a picture or folder")
        for target in targets
    ]  # fmt: skip


def _turn_covariance(known: Calibration, camera: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Of a camera's orientation (rad^2); none of the first, which is the frame, and where nobody stated it."""
    if known.covariance is None or camera == 0:
        return np.zeros((3, 3))
    first = camera * (len(LENS) + len(POSE)) - len(POSE) + len(LENS)
    return np.array(known.covariance[first : first + 3, first : first + 3])
