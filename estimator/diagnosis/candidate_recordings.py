"""What further data could be taken: one more drop, changed in one respect, or one quantity measured by other means.

A recording is a change of a drop like those of the campaign. All cameras of one recording share the errors of the lens that the model
knows, so a second camera is one of the same make as the first. A measurement is worth what its standard deviation says; that of a
lens is the error of a picture's corner that a calibration leaves.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.vocabulary.camera import HsvCamera, Intrinsics
from estimator.diagnosis.imagined_sequences import Drop, at_pixel, lasting
from estimator.motion.flight import Flight
from estimator.motion.rigid_body import quaternion_product
from estimator.motion.rotation import quaternion_from_vector

Array = NDArray[np.float64]
Change = Callable[[Drop], Drop]
FARTHER = 1.1
"""Distance of a second camera over that of the first."""


@dataclass(frozen=True)
class CandidateRecording:
    """A further drop: its name in ``words`` (a noun with its article), and the change that makes it from a recorded one.

    ``pictures``: whether it only makes sense for a camera.
    """

    key: str
    words: str
    change: Change
    pictures: bool = False


@dataclass(frozen=True)
class CandidateMeasurement:
    """One quantity measured by other means: the standard deviations by ``effect.parameter``, in the parameters' units.

    ``corner_px``: for lens parameters that ``sigma`` does not name, the error of the picture's corner that is left.
    """

    key: str
    words: str
    sigma: Mapping[str, float] = field(default_factory=dict)
    corner_px: float | None = None


def _same(drop: Drop) -> Drop:
    return drop


def _with_velocity(drop: Drop, v: Array) -> Drop:
    return replace(drop, flight=replace(drop.flight, v=v))


def _times_as_fast(ratio: float) -> Change:
    return lambda drop: _with_velocity(drop, ratio * drop.flight.v)


def _times_the_spin(ratio: float) -> Change:
    return lambda drop: replace(drop, flight=replace(drop.flight, omega=ratio * drop.flight.omega))


def _sideways(drop: Drop) -> Drop:
    """The velocity turned by 90 degrees about the first camera's axis."""
    axis = drop.cameras[0].R_cam_world[2]
    return _with_velocity(drop, _turned(axis) @ drop.flight.v)


def _other_attitude(drop: Drop) -> Drop:
    """The body turned by 90 degrees about an axis across its spin; the spin itself stays."""
    flight = drop.flight
    across = _across(flight.omega)
    return replace(drop, flight=replace(flight, q=quaternion_product(quaternion_from_vector(0.5 * np.pi * across), flight.q)))


def _nearer(drop: Drop) -> Drop:
    """The flight in the middle of the picture, half as far away."""
    flight, camera = at_pixel(drop).flight, drop.cameras[0]
    at = -camera.R_cam_world.T @ camera.t_cam_world
    return replace(drop, flight=replace(flight, x=at + 0.5 * (flight.x - at)))


def _second_camera(drop: Drop) -> Drop:
    """A second camera, the first one turned about the vertical by 90 degrees and a little farther away: no two stand alike."""
    first, flight = drop.cameras[0], drop.flight
    turn = _turned(_vertical(flight))
    R = first.R_cam_world @ turn.T
    at = flight.x + FARTHER * turn @ (-first.R_cam_world.T @ first.t_cam_world - flight.x)
    return replace(drop, cameras=(first, HsvCamera("second", first.intrinsics, R, -R @ at)))


def _released(drop: Drop) -> Drop:
    """A fall from rest, the velocity at the first frame known; the middle of the picture lies half-way down the path."""
    flight = at_pixel(drop).flight
    v = float(np.linalg.norm(flight.v)) * _vertical(flight)
    times = drop.times_s - drop.times_s[0] + flight.time_s
    half = 0.5 * float(times[-1] - times[0])
    x = flight.x - half * v - 0.5 * half**2 * flight.gravity_world
    return replace(drop, flight=replace(flight, x=x, v=v), times_s=times, known_start=True)


def _turned(axis: Array) -> Array:
    return np.asarray(Rotation.from_rotvec(0.5 * np.pi * axis).as_matrix())


def _vertical(flight: Flight) -> Array:
    """Unit vector along gravity, or along the world's second axis, down in the first picture, where there is none."""
    size = float(np.linalg.norm(flight.gravity_world))
    return np.asarray(flight.gravity_world / size if size > 0.0 else np.array([0.0, 1.0, 0.0]))


def _across(vector: Array) -> Array:
    """A unit vector across another."""
    other = np.cross(vector, np.eye(3)[int(np.argmin(np.abs(vector)))])
    return np.asarray(other / max(float(np.linalg.norm(other)), 1e-300))


RECORDINGS: tuple[CandidateRecording, ...] = (
    CandidateRecording("another", "another drop like these", _same),
    CandidateRecording("longer", "a drop filmed for twice as many frames", partial(lasting, ratio=2.0)),
    CandidateRecording("faster", "a drop twice as fast", _times_as_fast(2.0)),
    CandidateRecording("slower", "a drop half as fast", _times_as_fast(0.5)),
    CandidateRecording("opposite", "a drop thrown the opposite way", _times_as_fast(-1.0)),
    CandidateRecording("sideways", "a drop thrown at right angles to these in the picture", _sideways, pictures=True),
    CandidateRecording("spinning", "a drop with twice the spin", _times_the_spin(2.0)),
    CandidateRecording("calm", "a drop with a quarter of the spin", _times_the_spin(0.25)),
    CandidateRecording("other_attitude", "a drop with the particle turned by 90 degrees", _other_attitude),
    CandidateRecording("corner", "a drop near a corner of the picture", partial(at_pixel, place=(0.8, 0.2)), pictures=True),
    CandidateRecording("nearer", "a drop at half the distance from the camera", _nearer, pictures=True),
    CandidateRecording("released", "a fall from rest from a known height", _released),
    CandidateRecording("second_camera", "a drop filmed by a second camera, too, at right angles", _second_camera, pictures=True),
)
"""Recordings on trial, those that are easier to make first."""

MEASUREMENTS: tuple[CandidateMeasurement, ...] = (
    CandidateMeasurement("calliper", "the particle's size, measured to 0.1 %", {"length_scale.relative": 1e-3}),
    CandidateMeasurement("clock", "the frame rate, measured to 0.01 % with a flashing light", {"frame_rate.relative": 1e-4}),
    CandidateMeasurement(
        "plumb_line", "gravity in the camera's frame, measured to 0.02 m/s2 with a plumb line", {f"gravity.dg_{a}": 0.02 for a in "xyz"}
    ),
    CandidateMeasurement(
        "target",
        "the lens, calibrated with a target to 0.2 px in the corners",
        {"focal_length.relative": 5e-4, "principal_point.dx": 1.0, "principal_point.dy": 1.0},
        corner_px=0.2,
    ),
    CandidateMeasurement(
        "still_object",
        "the picture's motion, measured to 0.05 px on something at rest",
        {f"camera_vibration.{part}_{a}": 0.05 for part in ("sine", "cosine") for a in "xy"},
    ),
)
"""Measurements on trial."""


def corners_of(camera: Intrinsics) -> Array:
    """The picture's corners (4, 2) px."""
    return np.array([[x, y] for x in (0.0, camera.width_px - 1.0) for y in (0.0, camera.height_px - 1.0)])
