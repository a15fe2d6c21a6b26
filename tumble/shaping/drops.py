"""Drops as a user has them: pictures, masks or outlines of one instant, one for each camera of a rig, or views calibrated already."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.camera_files import calibration_at, observation_at
from datasets.errors import InputError
from datasets.names import file_name
from datasets.observation import CalibratedView, Recording
from datasets.observation_files import FILE as OBSERVATION_FILE
from datasets.outline_files import read_outlines
from datasets.particle_files import is_particle, read_particle
from datasets.video import open_video
from datasets.video.images import ImageFolder
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline
from estimator.outlines.masks import outline_of_mask
from estimator.outlines.recording import view_outlines_of
from tumble.importing.clip import Clip, background_picture, clip_of
from tumble.result_files import observations_in

Picture = NDArray[np.uint16]


@dataclass(frozen=True)
class Drop:
    """One set of ``views`` with their ``outlines`` (px), empty where none is usable; ``faults``: of such views, by number, the reason.

    ``posed``: the views' frame is the particle's already; else it is the rig's.
    """

    name: str
    path: Path
    outlines: tuple[Outline, ...]
    views: tuple[CalibratedView, ...]
    faults: dict[int, str]
    mass_kg: float | None = None
    posed: bool = False


@dataclass(frozen=True)
class Pictures:
    """How pictures are to be read: as ``masks``, with the ``backgrounds`` taken by each camera (none: as the picture's own light)."""

    masks: bool = False
    backgrounds: tuple[Path, ...] = ()


@dataclass(frozen=True)
class RigPictures:
    """One picture of each camera; implements :class:`datasets.observation.Frames`."""

    clip: Clip
    rows: tuple[int, ...]
    backgrounds: tuple[Picture, ...]

    @property
    def bit_depth(self) -> int:
        """Bits that carry signal."""
        return self.clip.bit_depth

    def __len__(self) -> int:
        return len(self.rows)

    def read(self, index: int) -> Picture:
        """The picture of a camera, (height, width) DN."""
        return self.clip.read(self.rows[index])

    def background(self) -> Picture | None:
        """None that all cameras share."""
        return None

    def background_of(self, index: int) -> Picture | None:
        """That of the camera."""
        return self.backgrounds[index] if self.backgrounds else None


def rig_of(path: Path) -> tuple[HsvCamera, ...]:
    """The cameras of a rig's calibration.

    Raises
    ------
    InputError
        Where there is none.
    """
    if not path.exists():
        raise InputError(f"{path}: expected a rig as tumble calibrate rig writes it (calibration.json), got no such folder or file.")
    calibration = calibration_at(path)
    if calibration is None or len(calibration.cameras) < 1:
        raise InputError(f"{path}: expected a rig as tumble calibrate rig writes it (calibration.json), got something else.")
    return calibration.cameras


def is_calibrated(path: Path) -> bool:
    """Whether ``path`` is a particle, an observation or a dataset, whose views need no rig."""
    return path.is_dir() and (is_particle(path) or (path / OBSERVATION_FILE).is_file() or (path / "observations").is_dir())


def calibrated_drop(path: Path) -> Drop:
    """The views of a particle file, of an observation, or of a dataset's first one, as one set.

    Raises
    ------
    InputError
        Where it has no calibrated views.
    """
    if is_particle(path):
        known = read_particle(path)
        return _drop(path, known.name, known.views, known.outlines, mass_kg=known.mass_kg, posed=True)
    observation = observation_at(observations_in(path)[0])
    if observation is None or not observation.views:
        raise InputError(f"{path}: expected an observation with calibrated views of the particle, got one without.")
    return _drop(path, observation.name, observation.views, observation.view_recording, mass_kg=observation.mass_kg, posed=True)


def drop_of(path: Path, rig: Sequence[HsvCamera], pictures: Pictures) -> Drop:
    """The set that a rig's cameras took at one instant.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    name = file_name(path.resolve().name if path.is_dir() else path.stem)
    views = tuple(CalibratedView(c.intrinsics, c.R_cam_world, c.t_cam_world, camera=k) for k, c in enumerate(rig))
    if path.suffix.lower() == ".npz":
        outlines = read_outlines(path)
        _refuse_other_count(path, len(outlines), rig)
        return _drop(path, name, views, outlines)
    clip, _ = clip_of(open_video(path), (None, None), None)
    rows, cameras = _rows(clip, rig)
    _refuse_other_size(path, clip, [rig[k] for k in cameras])
    seen = tuple(views[k] for k in cameras)
    if pictures.masks:
        full = float(max(int(clip.read(k).max()) for k in rows))
        return _drop(path, name, seen, tuple(outline_of_mask(clip.read(k), full=full) for k in rows))
    backgrounds = tuple(background_picture(pictures.backgrounds[k]) for k in cameras) if pictures.backgrounds else ()
    return _drop(path, name, seen, RigPictures(clip, tuple(rows), backgrounds))


def named_apart(drops: Sequence[Drop]) -> list[Drop]:
    """The drops with names of their own: of those that share one the second is called ``name-2``."""
    names = [drop.name for drop in drops]
    earlier = [names[:k].count(name) for k, name in enumerate(names)]
    return [replace(drop, name=f"{drop.name}-{count + 1}") if count else drop for drop, count in zip(drops, earlier, strict=True)]


def _drop(
    path: Path, name: str, views: Sequence[CalibratedView], recording: Recording, *, mass_kg: float | None = None, posed: bool = False
) -> Drop:
    track = view_outlines_of(recording, views, name=f"{path}")
    faults = {k: reason for k, (reason, used) in enumerate(zip(track.reasons, track.used, strict=True)) if not used}
    return Drop(name, path, track.outlines, tuple(views), faults, mass_kg, posed)


def _rows(clip: Clip, rig: Sequence[HsvCamera]) -> tuple[list[int], list[int]]:
    """Which picture is of which camera: by the names of a folder's files where they are the cameras', else by their order."""
    path, count = clip.video.path, len(clip)
    if isinstance(clip.video, ImageFolder):
        stems = [file_name(file.stem) for file in clip.video.files]
        names = [camera.name for camera in rig]
        if set(stems) <= set(names):
            return list(range(count)), [names.index(stem) for stem in stems]
    _refuse_other_count(path, count, rig)
    return list(range(count)), list(range(count))


def _refuse_other_count(path: Path, count: int, rig: Sequence[HsvCamera]) -> None:
    if count != len(rig):
        raise InputError(
            f"{path}: expected {len(rig)} pictures, one of each camera of the rig in its order, got {count}. Where a camera saw nothing, "
            f"name the others' files as the cameras are named ({', '.join(camera.name for camera in rig)})."
        )


def _refuse_other_size(path: Path, clip: Clip, cameras: Sequence[HsvCamera]) -> None:
    size = (clip.video.header.width_px, clip.video.header.height_px)
    for camera in cameras:
        stated = (camera.intrinsics.width_px, camera.intrinsics.height_px)
        if stated != size:
            raise InputError(
                f"{path}: expected pictures of {stated[0]} x {stated[1]} px as camera {camera.name} has, got {size[0]} x {size[1]} px."
            )
