"""One flight's recordings and what was stated beside them, made into an observation, or into a list of what is missing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.camera_files import observation_at, read_camera, read_gravity, states_principal_point
from datasets.errors import InputError
from datasets.names import file_name
from datasets.observation import CalibratedView, Made, Observation, Recording
from datasets.particle_files import is_particle, read_particle
from datasets.video import Origin
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.clock import Clock
from tumble.importing.request import Missing, Request, Value
from tumble.importing.sources import Source, source_of
from tumble.importing.timing import clocks_of, own_clocks
from tumble.result_files import observations_in

Array = NDArray[np.float64]
STANDARD_GRAVITY_MS2 = 9.80665
ASSUMED_CENTRE = 0.02
"""Standard deviation of an assumed principal point over the picture's larger side: lenses sit in their mounts within one to three per
cent of it. By judgement."""
CROPPED = "their centre is not where the lens's axis is"
CAMERA = Missing(
    "camera",
    "lengths need the camera's focal length in pixels",
    "--camera FILE (TOML or JSON with width_px, height_px, fx_px, fy_px; or an observation that has the camera)",
)
PARTICLE = Missing(
    "particle",
    "rotation is measured against calibrated views of the particle",
    "--particle FOLDER (what tumble shape wrote, or an observation or a dataset that has the particle's calibrated views)",
)
GRAVITY = Missing(
    "gravity", "flights bend by it", "--gravity down (rows of the picture run downwards), --gravity=X,Y,Z in m/s2, or --gravity FILE"
)


@dataclass(frozen=True)
class Gathered:
    """What is known of one flight: ``values`` with where they are from, what is ``missing``, ``remarks`` for the user.

    ``sources``: one per camera. ``clocks``: of each, where rate and exposure are known. ``observation``: where nothing is missing.
    """

    name: str
    sources: tuple[Source, ...]
    cameras: tuple[HsvCamera, ...]
    values: tuple[Value, ...]
    missing: tuple[Missing, ...]
    remarks: tuple[str, ...]
    clocks: tuple[Clock, ...]
    observation: Observation | None


@dataclass(frozen=True)
class Particle:
    """Calibrated views and their recording, the mass where it was weighed, and the particle file's folder with what is kept there."""

    views: tuple[CalibratedView, ...]
    view_recording: Recording
    mass_kg: float | None
    particle: Path | None
    made: Made | None


def gather(videos: Sequence[Path], request: Request, *, decode: bool = True) -> Gathered:
    """Read one flight's ``videos`` (one per camera) and everything that was stated beside them; without ``decode`` headers only.

    Raises
    ------
    InputError
        Where a file is damaged or what was stated contradicts it.
    """
    if request.clock_sigma_s > 0.0 and len(videos) < 2:
        raise InputError("--clock-sigma: expected several cameras of one flight, got one.")
    sources = tuple(source_of(path, request, decode=decode) for path in videos)
    clocks, values, missing, remarks = clocks_of(sources, request)
    cameras = tuple(_as_sure(_camera(path, sources, k), request, k) for k, path in enumerate(request.cameras))
    values += [
        Value("camera", _lens(c), str(p.resolve()), Origin.GIVEN, f"--camera {p}") for c, p in zip(cameras, request.cameras, strict=True)
    ]
    values += [_principal_point(c, k, p) for k, (c, p) in enumerate(zip(cameras, request.cameras, strict=True))]
    missing += [] if cameras else [CAMERA]
    values += [] if request.length_sigma is None else [_lengths(request.length_sigma)]
    particle = None if request.particle is None else _particle(request.particle)
    gravity = None if request.gravity is None else _gravity(request.gravity, cameras)
    values += [] if request.particle is None or particle is None else [_views_value(request.particle, particle)]
    values += [] if gravity is None else [gravity[2]]
    missing += ([] if particle is not None else [PARTICLE]) + ([] if gravity is not None else [GRAVITY])
    observation = None
    if clocks and particle is not None and gravity is not None and not missing:
        observation = Observation(
            name=flight_name(videos),
            cameras=cameras,
            recordings=tuple(source.recording for source in sources),
            clock=clocks[0],
            camera_clocks=own_clocks(clocks),
            gravity_world=gravity[0],
            views=particle.views,
            view_recording=particle.view_recording,
            mass_kg=particle.mass_kg,
            gravity_covariance=gravity[1],
            sigma_length_scale=request.length_sigma,
            particle=particle.particle,
            made=particle.made,
        )
    every = _named_apart([*(value for source in sources for value in source.values), *values])
    said = [*(remark for source in sources for remark in source.remarks), *remarks]
    return Gathered(flight_name(videos), sources, cameras, tuple(every), tuple(missing), tuple(said), clocks, observation)


def _named_apart(values: Sequence[Value]) -> list[Value]:
    """The same values; what further cameras have of one name is numbered from 2 on."""
    counts: dict[str, int] = {}
    named = []
    for value in values:
        counts[value.name] = number = counts.get(value.name, 0) + 1
        named.append(value if number == 1 else replace(value, name=f"{value.name}_{number}"))
    return named


def flight_name(videos: Sequence[Path]) -> str:
    """The name of a flight's observation: that of its first video."""
    first = videos[0].resolve()
    return file_name(first.name if first.is_dir() else first.stem)


def _camera(path: Path, sources: Sequence[Source], number: int) -> HsvCamera:
    """The calibrated camera of a source, of the size of its pictures, with a name of its own."""
    camera, source = read_camera(path, number), sources[number]
    size = (camera.intrinsics.width_px, camera.intrinsics.height_px)
    if source.size_px is not None and size != source.size_px:
        raise InputError(
            f"{path}: expected a calibration of pictures of {source.size_px[0]} x {source.size_px[1]} px as {source.path} has, "
            f"got {size[0]} x {size[1]}; a part of the sensor has a principal point and a size of its own."
        )
    return replace(camera, name="hsv" if len(sources) == 1 else f"hsv_{number + 1}")


def _as_sure(camera: HsvCamera, request: Request, number: int) -> HsvCamera:
    """The camera with how sure its lens is, where its calibration does not say it: as stated beside it, and as its assumed centre is."""
    path = request.cameras[number]
    if camera.lens_covariance is not None:
        if request.focal_sigma is not None:
            raise InputError(f"--focal-sigma: expected a camera that does not say how sure its lens is, got {path}, which does.")
        return camera
    lens, C = camera.intrinsics, np.zeros((9, 9))
    if request.focal_sigma is not None:
        f = np.array([lens.fx_px, lens.fy_px])
        C[:2, :2] = request.focal_sigma**2 * np.outer(f, f)
    if not states_principal_point(path, number):
        C[2, 2] = C[3, 3] = (ASSUMED_CENTRE * max(lens.width_px, lens.height_px)) ** 2
    return replace(camera, lens_covariance=C) if C.any() else camera


def _lens(camera: HsvCamera) -> str:
    words = f"focal length {camera.intrinsics.fx_px:.1f} x {camera.intrinsics.fy_px:.1f} px"
    if camera.lens_covariance is None or not camera.lens_covariance[0, 0]:
        return f"{words}, taken as exact: how sure it is not stated (--focal-sigma)"
    sigma = np.sqrt(camera.lens_covariance[0, 0]) / camera.intrinsics.fx_px
    return f"{words} ± {100.0 * sigma:.2g} %"


def _principal_point(camera: HsvCamera, number: int, path: Path) -> Value:
    """Where the lens's axis meets the picture, and whether the calibration says it."""
    lens, stated = camera.intrinsics, states_principal_point(path, number)
    sigma = 0.0 if camera.lens_covariance is None else float(np.sqrt(camera.lens_covariance[2, 2]))
    return Value(
        "principal_point",
        f"({lens.cx_px:.1f}, {lens.cy_px:.1f})" + (f" ± {sigma:.2g} px" if sigma else " px"),
        [lens.cx_px, lens.cy_px],
        Origin.GIVEN if stated else Origin.ASSUMED,
        f"--camera {path}"
        if stated
        else f"the centre of the picture. Pictures of a part of the sensor need cx_px, cy_px in {path}: {CROPPED}",
    )


def _particle(path: Path) -> Particle:
    """The views of a particle file, or of an observation."""
    if is_particle(path):
        known = read_particle(path)
        return Particle(known.views, known.outlines, known.mass_kg, known.folder, known.made)
    folders = observations_in(path.parent if path.is_file() else path)
    told = observation_at(folders[0])
    if told is None or not told.views:
        raise InputError(f"{path}: expected an observation with calibrated views of the particle, got one without.")
    return Particle(told.views, told.view_recording, told.mass_kg, told.particle, told.made)


def _views_value(path: Path, particle: Particle) -> Value:
    weighed = "" if particle.mass_kg is None else f", mass {particle.mass_kg:g} kg"
    return Value("particle", f"{len(particle.views)} calibrated views{weighed}", str(path.resolve()), Origin.GIVEN, f"--particle {path}")


def _lengths(sigma: float) -> Value:
    return Value("lengths", f"known to {100.0 * sigma:.3g} %", sigma, Origin.GIVEN, "--length-sigma")


def _gravity(said: str, cameras: Sequence[HsvCamera]) -> tuple[Array, Array | None, Value]:
    """Gravity (3,) m/s2 in the world frame, which is the first camera's unless its calibration says otherwise; its covariance, if any."""
    covariance = None
    if said == "down":
        R = cameras[0].R_cam_world if cameras else np.eye(3)
        vector, origin = R.T @ np.array([0.0, STANDARD_GRAVITY_MS2, 0.0]), Origin.ASSUMED
        note = "--gravity down: standard gravity along the picture's columns, the camera taken to be level"
    elif Path(said).exists():
        (vector, covariance), origin, note = read_gravity(Path(said)), Origin.GIVEN, f"--gravity {said}"
    else:
        vector, origin, note = _numbers(said), Origin.GIVEN, "--gravity"
    shown = ", ".join(f"{component:.4f}" for component in vector)
    return vector, covariance, Value("gravity", f"({shown}) m/s2", vector.tolist(), origin, note)


def _numbers(said: str) -> Array:
    try:
        vector = np.array([float(part) for part in said.split(",")])
    except ValueError:
        vector = np.zeros(0)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise InputError(f"--gravity {said}: expected down, three numbers as in 0,9.81,0, or a file; there is no such file.")
    return vector
