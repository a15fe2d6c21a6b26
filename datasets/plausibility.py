"""Whether an observation can be true: units, rotations, times, picture sizes.

The bounds are wide; they catch mistakes (millimetres taken for metres, a transposed size, a broken clock), not unusual experiments.
A message names the file's folder, where in ``observation.json`` the value stands, what was expected and what came.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.covariances import check_covariance
from datasets.errors import InputError
from datasets.observation import CalibratedView, Frames, Observation, Recording
from datasets.plausible_clocks import check_clocks
from datasets.plausible_pace import check_pace
from datasets.rounded_rotations import ROUNDED_ROTATION
from datasets.tiff_frames import TiffFrames
from datasets.vocabulary.camera import LARGEST_PICTURE_PX, HsvCamera, Intrinsics
from datasets.vocabulary.frames import is_rotation
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.plate import Plate

Array = NDArray[np.float64]

FARTHEST_M = 50.0
STRONGEST_GRAVITY_MS2 = 300.0
LEAST_KNOWN_LENGTHS = 0.1
"""Relative standard deviation of lengths, as the schema has it: more is a share that was meant as per cent."""
HEAVIEST_KG = 1000.0
LARGEST_UNDISTORTION_ERROR_PX = 0.01
UNIT_TOLERANCE = 1e-6
FASTEST_PLATE_MS = 100.0
EDGE_POINTS = 9
"""Along each side of a picture."""
OUTSIDE_PICTURES = 3.0
"""How many picture sizes beyond its picture an outline may reach before it must belong to another camera."""


@np.errstate(all="ignore")
def check_observation(obs: Observation, path: Path) -> None:
    """Check everything that can be said without reading pictures' pixels.

    Parameters
    ----------
    obs
        What was read.
    path
        ``observation.json``, to be named in messages.

    Raises
    ------
    InputError
        At the first thing that cannot be true.
    """
    _check_names(obs, path)
    check_clocks(obs, path)
    _check_gravity(obs.gravity_world, path)
    if obs.gravity_covariance is not None:
        check_covariance(obs.gravity_covariance, f"{path}: at $.gravity_covariance")
    if obs.sigma_length_scale is not None and not 0 < obs.sigma_length_scale <= LEAST_KNOWN_LENGTHS:
        told = f"expected more than 0 and at most {LEAST_KNOWN_LENGTHS:.0%}, got {100.0 * obs.sigma_length_scale:g}%"
        raise InputError(f"{path}: at $.sigma_length_scale: how well lengths are known: {told}; 0.1% is 0.001.")
    if obs.mass_kg is not None and not 0 < obs.mass_kg < HEAVIEST_KG:
        raise InputError(f"{path}: at $.mass_kg: expected kilograms below {HEAVIEST_KG:g}, got {obs.mass_kg:g}; is it in grams?")
    times = len(obs.clock.times_s)
    for c, (camera, recording, clock) in enumerate(zip(obs.cameras, obs.recordings, obs.clocks, strict=True)):
        where = f"$.cameras[{c}]"
        check_camera(camera, f"{path}: at {where}")
        _check_recording(recording, [camera.intrinsics] * len(clock.times_s), path, f'camera "{camera.name}"')
    for camera, recording in zip(obs.cameras, obs.further_recordings, strict=bool(obs.further_recordings)):
        _check_recording(recording, [camera.intrinsics] * times, path, f'camera "{camera.name}", further outlines')
    _check_views(obs.views, f"{path}: at $.views")
    if obs.companion is not None:
        _check_views(obs.companion.views, f"{path}: at $.companion.views")
        _check_recording(
            obs.companion.view_recording, [v.intrinsics for v in obs.companion.views], path, "the companion's calibrated views"
        )
    if obs.plate is not None:
        check_plate(obs.plate, f"{path}: at $.plate")
    _check_recording(obs.view_recording, [view.intrinsics for view in obs.views], path, "calibrated views")
    check_pace(obs, path)


@np.errstate(all="ignore")
def check_view_set(views: tuple[CalibratedView, ...], recording: Recording, path: Path) -> None:
    """Check calibrated views and what they recorded, of the document ``path``.

    Raises
    ------
    InputError
        At the first thing that cannot be true.
    """
    _check_views(views, f"{path}: at $.views")
    _check_recording(recording, [view.intrinsics for view in views], path, "calibrated views")


def _check_names(obs: Observation, path: Path) -> None:
    names = [camera.name for camera in obs.cameras]
    for c, name in enumerate(names):
        if name in names[:c]:
            raise InputError(f'{path}: at $.cameras[{c}].name: expected a name of its own, got "{name}", that of another.')


def _check_views(views: tuple[CalibratedView, ...], place: str) -> None:
    for v, view in enumerate(views):
        where = f"{place}.cameras[{v}]"
        _check_pose(view.R_cam_particle, view.t_cam_particle, where, "particle")
        _check_intrinsics(view.intrinsics, f"{where}.intrinsics")


def _check_gravity(gravity: Array, path: Path) -> None:
    strength = float(np.linalg.norm(gravity))
    if not strength <= STRONGEST_GRAVITY_MS2:
        raise InputError(
            f"{path}: at $.gravity_world: expected m/s2 (9.81 on Earth), got {strength:g}; it looks like millimetres taken for metres."
        )


def check_plate(plate: Plate, where: str) -> None:
    """Check that a plate's normal has length 1 and that its lengths are metres.

    Raises
    ------
    InputError
        Naming ``where``, what was expected and what came.
    """
    length = float(np.linalg.norm(plate.normal_world))
    if not abs(length - 1) <= UNIT_TOLERANCE:
        raise InputError(f"{where}.normal_world: expected a vector of length 1, got one of length {length:.6g}.")
    distance, speed = float(np.linalg.norm(plate.point_world)), float(np.linalg.norm(plate.velocity_world))
    if not distance <= FARTHEST_M:
        raise InputError(f"{where}.point_world: expected metres (at most {FARTHEST_M:g}), got {distance:g}; are they millimetres?")
    if not speed <= FASTEST_PLATE_MS:
        raise InputError(f"{where}.velocity_world: expected m/s (at most {FASTEST_PLATE_MS:g}), got {speed:g}; are they mm/s?")


def _check_pose(R: Array, t: Array, where: str, frame: str) -> None:
    if not is_rotation(R, tolerance=ROUNDED_ROTATION):
        raise InputError(f"{where}.R_cam_{frame}: expected a rotation (orthonormal rows, determinant +1), got {_departure(R)}.")
    distance = float(np.linalg.norm(t))
    if not distance <= FARTHEST_M:
        raise InputError(
            f"{where}.t_cam_{frame}: expected metres (at most {FARTHEST_M:g}), got a distance of {distance:g}; "
            "it looks like millimetres taken for metres."
        )
    if frame == "particle" and t[2] <= 0:
        raise InputError(f"{where}.t_cam_particle: expected the particle in front of the camera (z > 0), got z = {t[2]:g}.")


def _departure(R: Array) -> str:
    error = float(np.abs(R @ R.T - np.eye(3)).max())
    return f"a mirrored one (determinant {np.linalg.det(R):.3g})" if error < 1e-6 else f"one whose rows miss orthonormality by {error:.2g}"


@np.errstate(all="ignore")
def check_camera(camera: HsvCamera, where: str) -> None:
    """Refuse, naming ``where``, a camera with a pose or a lens that none can have.

    Raises
    ------
    InputError
        With what was expected and what came.
    """
    _check_pose(camera.R_cam_world, camera.t_cam_world, where, "world")
    _check_intrinsics(camera.intrinsics, f"{where}.intrinsics")
    if camera.lens_covariance is not None:
        check_covariance(camera.lens_covariance, f"{where}.lens_covariance")
        _check_focal_sigma(camera.lens_covariance, camera.intrinsics, f"{where}.lens_covariance")


def _check_focal_sigma(covariance: NDArray[np.float64], intrinsics: Intrinsics, where: str) -> None:
    """A standard deviation as large as the focal length says that it may be none: no derivative holds there."""
    for row, focal in enumerate((intrinsics.fx_px, intrinsics.fy_px)):
        sigma = float(np.sqrt(covariance[row, row]))
        if sigma >= focal:
            raise InputError(f"{where}: expected focal lengths known to less than themselves, got {focal:.6g} ± {sigma:.3g} px.")


def _check_intrinsics(intrinsics: Intrinsics, where: str) -> None:
    if intrinsics.width_px * intrinsics.height_px > LARGEST_PICTURE_PX:
        raise InputError(
            f"{where}: expected a picture of at most {LARGEST_PICTURE_PX:.0e} px, got {intrinsics.width_px} x {intrinsics.height_px} px."
        )
    far = max(intrinsics.width_px, intrinsics.height_px) * 5
    if abs(intrinsics.cx_px - intrinsics.width_px / 2) > far or abs(intrinsics.cy_px - intrinsics.height_px / 2) > far:
        raise InputError(
            f"{where}: expected a principal point near the {intrinsics.width_px} x {intrinsics.height_px} px picture, "
            f"got ({intrinsics.cx_px:g}, {intrinsics.cy_px:g})."
        )
    pitch = intrinsics.pixel_pitch_m
    if pitch is not None and pitch > 1e-3:
        raise InputError(f"{where}.pixel_pitch_m: expected metres (20e-6 is usual), got {pitch:g}; it looks like another unit.")
    lost = undistortion_error_px(intrinsics)
    if not lost <= LARGEST_UNDISTORTION_ERROR_PX:
        raise InputError(
            f"{where}.distortion: expected a distortion that can be undone all over the {intrinsics.width_px} x {intrinsics.height_px} px "
            f"picture, got {list(intrinsics.distortion)}, which misses by {lost:.3g} px at its edge; the order is k1, k2, p1, p2, k3."
        )


def undistortion_error_px(intrinsics: Intrinsics) -> float:
    """How far (px) a point of the picture's edge lies at most from itself after its distortion was removed and put on again."""
    if not any(intrinsics.distortion):
        return 0.0
    u, v = (np.linspace(-0.5, size - 0.5, EDGE_POINTS) for size in (intrinsics.width_px, intrinsics.height_px))
    grid = np.stack(np.meshgrid(u, v), axis=-1)
    edge = np.concatenate([grid[0], grid[-1], grid[:, 0], grid[:, -1]])
    with np.errstate(all="ignore"):
        return float(np.abs(intrinsics.distort(intrinsics.normalise(edge)) - edge).max())


def _check_recording(recording: Recording, intrinsics: list[Intrinsics], path: Path, what: str) -> None:
    """Number of entries and size of the pictures; outlines have to lie on or near their picture."""
    if len(recording) != len(intrinsics):
        if isinstance(recording, TiffFrames) and intrinsics:
            recording.check(len(intrinsics), intrinsics[0].width_px, intrinsics[0].height_px, what)
        raise InputError(f"{path}: {what}: expected {len(intrinsics)} recorded entries, got {len(recording)}.")
    if isinstance(recording, TiffFrames):
        _check_one_size(intrinsics, path, what)
        recording.check(len(intrinsics), intrinsics[0].width_px, intrinsics[0].height_px, what)
    elif not isinstance(recording, Frames):
        for k, (outline, camera) in enumerate(zip(recording, intrinsics, strict=True)):
            _check_outline(outline, camera, f"{path}: {what}: outline {k}")


def _check_one_size(intrinsics: list[Intrinsics], path: Path, what: str) -> None:
    """The pictures of one stack are of one size, so their cameras have to be."""
    sizes = [(camera.width_px, camera.height_px) for camera in intrinsics]
    odd = next((k for k, size in enumerate(sizes) if size != sizes[0]), None)
    if odd is not None:
        (width, height), (first_width, first_height) = sizes[odd], sizes[0]
        raise InputError(
            f"{path}: {what}: expected cameras of one picture size, since their pictures are one stack, "
            f"got {first_width} x {first_height} px for entry 0 and {width} x {height} for entry {odd}."
        )


def _check_outline(outline: Outline, camera: Intrinsics, where: str) -> None:
    if outline.empty:
        return
    size = np.array([camera.width_px, camera.height_px])
    low, high = outline.points_px.min(axis=0), outline.points_px.max(axis=0)
    if np.any(low < -OUTSIDE_PICTURES * size) or np.any(high > (1 + OUTSIDE_PICTURES) * size):
        raise InputError(
            f"{where}: expected pixels of a {size[0]} x {size[1]} picture, got x from {low[0]:.0f} to {high[0]:.0f} "
            f"and y from {low[1]:.0f} to {high[1]:.0f}."
        )
