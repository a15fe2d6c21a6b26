"""An observation as a folder: ``observation.json`` and, beside it, frames or outlines.

``frames_<camera>.tif`` (and ``background_<camera>.tif``) or ``outlines_<camera>.npz`` per HSV camera; ``views.tif`` (and
``views_background.tif``, one page per rig camera) or ``view_outlines.npz`` for the calibrated views. See ``docs/format.md``.
Frames are read lazily. Nothing here knows of truth or recipes: an estimator may import it.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets import state_entries
from datasets.errors import InputError
from datasets.json_documents import Document, read_document, write_document
from datasets.made_files import made_in
from datasets.observation import CalibratedView, Companion, Frames, Observation, Recording
from datasets.outline_files import read_outlines, write_outlines
from datasets.plausibility import check_observation
from datasets.rounded_rotations import with_rotations
from datasets.tiff_frames import FrameStackWriter, Picture, TiffFrames, write_stack
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline, oriented

FILE = "observation.json"


def frames_file(camera: str) -> str:
    """The name of an HSV camera's stack."""
    return f"frames_{camera}.tif"


def background_file(camera: str) -> str:
    """The name of an HSV camera's background."""
    return f"background_{camera}.tif"


VIEWS_FILE = "views.tif"
VIEWS_BACKGROUND_FILE = "views_background.tif"


def write_observation(obs: Observation, folder: Path) -> None:
    """Write ``obs`` to ``folder``; ``observation.json`` comes last, so its presence says that the rest is whole.

    Stacks that lie in ``folder`` already (a renderer put them there page by page) are referred to, not copied.

    Raises
    ------
    InputError
        When the observation cannot be true (see :mod:`datasets.plausibility`).
    TumbleError
        When the disk does not take it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    plates = obs.plate_outlines or (None,) * len(obs.cameras)
    further = obs.further_recordings or (None,) * len(obs.cameras)
    cameras = [
        {
            **camera_entry(camera),
            "recording": _store_camera(camera.name, recording, folder),
            **_plate_outline_entry(outline),
            **_further_entry(camera.name, other, folder),
            **_own_clock_entry(obs, number),
        }
        for number, (camera, recording, outline, other) in enumerate(zip(obs.cameras, obs.recordings, plates, further, strict=True))
    ]
    views = {"recording": _store_views(obs, folder), "cameras": [view_entry(view) for view in obs.views]}
    content: Document = {
        "name": obs.name,
        "cameras": cameras,
        "clock": _clock_entry(obs.clock),
        "gravity_world": obs.gravity_world,
        "mass_kg": obs.mass_kg,
        "views": views,
    }
    if obs.gravity_covariance is not None:
        content["gravity_covariance"] = obs.gravity_covariance
    if obs.sigma_length_scale is not None:
        content["sigma_length_scale"] = obs.sigma_length_scale
    if obs.particle is not None:
        content["particle"] = Path(os.path.relpath(obs.particle, folder)).as_posix()
    if obs.plate is not None:
        content["plate"] = state_entries.plate_entry(obs.plate)
    if obs.companion is not None:
        content["companion"] = _companion_entry(obs.companion, folder)
    check_observation(obs, folder / FILE)
    write_document(folder / FILE, "observation", content)


def read_observation(folder: Path) -> Observation:
    """Read an observation; pictures stay on disk until they are asked for.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: expected the folder of an observation, got {'a file' if folder.exists() else 'nothing'}.")
    document = read_document(folder / FILE, "observation")
    clocks, views = _clocks(document, folder), document["views"]
    particle = folder / document["particle"] if "particle" in document else None
    obs = Observation(
        name=document["name"],
        cameras=tuple(camera_of_entry(entry) for entry in document["cameras"]),
        recordings=tuple(
            _load(entry["recording"], folder, len(clock.times_s)) for entry, clock in zip(document["cameras"], clocks, strict=True)
        ),
        clock=clocks[0],
        gravity_world=_array(document["gravity_world"]),
        views=tuple(view_of_entry(entry) for entry in views["cameras"]),
        view_recording=_load(views["recording"], folder, len(views["cameras"])),
        mass_kg=document.get("mass_kg"),
        plate=state_entries.plate(document["plate"]) if "plate" in document else None,
        plate_outlines=_plate_outlines(document["cameras"]),
        companion=_companion(document["companion"], folder) if "companion" in document else None,
        further_recordings=_further_recordings(document, folder),
        gravity_covariance=_array(document["gravity_covariance"]) if "gravity_covariance" in document else None,
        sigma_length_scale=document.get("sigma_length_scale"),
        particle=particle,
        made=None if particle is None else made_in(particle),
        camera_clocks=clocks if any("clock" in entry for entry in document["cameras"]) else (),
    )
    check_observation(obs, folder / FILE)
    return with_rotations(obs, folder / FILE)


def _array(value: Any) -> NDArray[np.float64]:
    return np.array(value, dtype=np.float64)


def _intrinsics_entry(intrinsics: Intrinsics) -> Document:
    return {
        "width_px": intrinsics.width_px,
        "height_px": intrinsics.height_px,
        "fx_px": intrinsics.fx_px,
        "fy_px": intrinsics.fy_px,
        "cx_px": intrinsics.cx_px,
        "cy_px": intrinsics.cy_px,
        "distortion": intrinsics.distortion,
        "pixel_pitch_m": intrinsics.pixel_pitch_m,
    }


def _intrinsics(entry: Document) -> Intrinsics:
    """Intrinsics; the principal point is the image's centre where it is not given."""
    k1, k2, p1, p2, k3 = (float(k) for k in entry.get("distortion", (0, 0, 0, 0, 0)))
    pitch = entry.get("pixel_pitch_m")
    return Intrinsics(
        width_px=entry["width_px"],
        height_px=entry["height_px"],
        fx_px=float(entry["fx_px"]),
        fy_px=float(entry["fy_px"]),
        cx_px=float(entry.get("cx_px", (entry["width_px"] - 1) / 2)),
        cy_px=float(entry.get("cy_px", (entry["height_px"] - 1) / 2)),
        distortion=(k1, k2, p1, p2, k3),
        pixel_pitch_m=None if pitch is None else float(pitch),
    )


def camera_entry(camera: HsvCamera) -> Document:
    """A high-speed camera's entry in a document, without its recording."""
    entry = {
        "name": camera.name,
        "intrinsics": _intrinsics_entry(camera.intrinsics),
        "R_cam_world": camera.R_cam_world,
        "t_cam_world": camera.t_cam_world,
    }
    return entry if camera.lens_covariance is None else {**entry, "lens_covariance": camera.lens_covariance}


def camera_of_entry(entry: Document) -> HsvCamera:
    """A high-speed camera from its entry in a document that fits the schema."""
    spread = entry.get("lens_covariance")
    return HsvCamera(
        entry["name"],
        _intrinsics(entry["intrinsics"]),
        _array(entry["R_cam_world"]),
        _array(entry["t_cam_world"]),
        None if spread is None else _array(spread),
    )


def _clock_entry(clock: Clock) -> Document:
    entry: Document = {"times_s": clock.times_s, "exposure_s": clock.exposure_s}
    spread = {"offset_sigma_s": clock.offset_sigma_s, "rate_sigma": clock.rate_sigma}
    return {**entry, **{key: sigma for key, sigma in spread.items() if sigma != 0.0}}


def _own_clock_entry(obs: Observation, camera: int) -> Document:
    """Left out where a camera goes by the first one's clock."""
    own = obs.clock_of(camera)
    return {} if camera == 0 or own is obs.clock else {"clock": _clock_entry(own)}


def _clock(entry: Document) -> Clock:
    spread = (float(entry.get(key, 0.0)) for key in ("offset_sigma_s", "rate_sigma"))
    return Clock(_array(entry["times_s"]), float(entry["exposure_s"]), *spread)


def _clocks(document: Document, folder: Path) -> tuple[Clock, ...]:
    """Of every camera; the first one's is that of the observation."""
    first, cameras = _clock(document["clock"]), document["cameras"]
    if "clock" in cameras[0]:
        raise InputError(f"{folder / FILE}: at $.cameras[0].clock: expected none, since $.clock is the first camera's, got one.")
    return tuple(_clock(entry["clock"]) if "clock" in entry else first for entry in cameras)


def _plate_outline_entry(outline: Outline | None) -> Document:
    """Left out where there is no plate, so that recordings without one are written as ever."""
    return {} if outline is None else {"plate_outline_px": outline.points_px}


def _plate_outlines(cameras: list[Document]) -> tuple[Outline | None, ...]:
    found = [entry.get("plate_outline_px") for entry in cameras]
    if not any(found):
        return ()
    return tuple(None if points is None else Outline(oriented(_array(points))) for points in found)


def _further_entry(name: str, recording: Recording | None, folder: Path) -> Document:
    """Left out where there is one particle."""
    return {} if recording is None else {"further_recording": _store_outlines(recording, folder / f"further_outlines_{name}.npz")}


def _further_recordings(document: Document, folder: Path) -> tuple[Recording, ...]:
    """Those of all cameras; a companion needs them, and nothing else does."""
    found = [camera["further_recording"] for camera in document["cameras"] if "further_recording" in camera]
    wanted = len(document["cameras"]) if "companion" in document else 0
    if len(found) != wanted:
        raise InputError(
            f"{folder / FILE}: expected a further_recording of {'every' if wanted else 'no'} camera, since there is "
            f"{'a' if wanted else 'no'} companion, got {len(found)} of {len(document['cameras'])} cameras with one."
        )
    return tuple(_load(entry, folder, len(document["clock"]["times_s"])) for entry in found)


def _companion_entry(companion: Companion, folder: Path) -> Document:
    views = [view_entry(view) for view in companion.views]
    recording = _store_outlines(companion.view_recording, folder / "companion_view_outlines.npz")
    return {"mass_kg": companion.mass_kg, "views": {"recording": recording, "cameras": views}}


def _companion(entry: Document, folder: Path) -> Companion:
    views = tuple(view_of_entry(view) for view in entry["views"]["cameras"])
    return Companion(views, _load(entry["views"]["recording"], folder, len(views)), entry.get("mass_kg"))


def view_entry(view: CalibratedView) -> Document:
    """A calibrated view's entry in a document."""
    return {
        "intrinsics": _intrinsics_entry(view.intrinsics),
        "R_cam_particle": view.R_cam_particle,
        "t_cam_particle": view.t_cam_particle,
        "drop": view.drop,
        "camera": view.camera,
    }


def view_of_entry(entry: Document) -> CalibratedView:
    """A calibrated view from its entry in a document that fits the schema."""
    R, t = _array(entry["R_cam_particle"]), _array(entry["t_cam_particle"])
    return CalibratedView(_intrinsics(entry["intrinsics"]), R, t, entry.get("drop", 0), entry.get("camera", 0))


def _store_camera(name: str, recording: Recording, folder: Path) -> Document:
    if not isinstance(recording, Frames):
        return _store_outlines(recording, folder / f"outlines_{name}.npz")
    background = recording.background()
    backgrounds = [] if background is None else [background]
    return _store_frames(recording, folder / frames_file(name), folder / background_file(name), backgrounds, None)


def _store_views(obs: Observation, folder: Path) -> Document:
    """The views' recording; pictures of one rig camera share one page of the backgrounds."""
    recording = obs.view_recording
    if not isinstance(recording, Frames):
        return _store_outlines(recording, folder / "view_outlines.npz")
    numbers = sorted({view.camera for view in obs.views})
    first = [next(k for k, view in enumerate(obs.views) if view.camera == number) for number in numbers]
    backgrounds = [recording.background_of(k) for k in first]
    present = [background for background in backgrounds if background is not None]
    if len(present) < len(backgrounds):
        present = []
    pages = [numbers.index(view.camera) for view in obs.views] if present else None
    return _store_frames(recording, folder / VIEWS_FILE, folder / VIEWS_BACKGROUND_FILE, present, pages)


def _store_outlines(recording: Recording, path: Path) -> Document:
    write_outlines(path, list(recording))  # type: ignore[arg-type]
    return {"kind": "outlines", "file": path.name}


def _store_frames(frames: Frames, path: Path, background_path: Path, backgrounds: list[Picture], pages: list[int] | None) -> Document:
    if not _lies_at(frames, path):
        with FrameStackWriter(path) as writer:
            for k in range(len(frames)):
                writer.append(frames.read(k))
    if backgrounds:
        write_stack(background_path, backgrounds)
    background = background_path.name if backgrounds else None
    return {"kind": "frames", "file": path.name, "bit_depth": frames.bit_depth, "background": background, "background_pages": pages}


def _lies_at(frames: Frames, path: Path) -> bool:
    return isinstance(frames, TiffFrames) and path.exists() and frames.path.resolve() == path.resolve()


def _load(entry: Document, folder: Path, count: int) -> Recording:
    """A recording of ``count`` entries."""
    if entry["kind"] == "outlines":
        return read_outlines(folder / entry["file"], count)
    background, pages = entry.get("background"), entry.get("background_pages")
    return TiffFrames(
        folder / entry["file"],
        entry["bit_depth"],
        None if background is None else folder / background,
        None if pages is None else tuple(pages),
    )
