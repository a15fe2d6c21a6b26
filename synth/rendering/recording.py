"""From rendered particles to what cameras record: the background behind them, the sensor, TIFF stacks, masks.

The sensors of the high-speed camera and of the rig's cameras are of one make (the recipe's), but each has a fixed pattern of its own,
which belongs to the benchmark, not to the sequence. A background is the average of ``BACKGROUND_EXPOSURES`` pictures taken without
the particle.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from datasets.observation_files import VIEWS_BACKGROUND_FILE, VIEWS_FILE, background_file, frames_file
from datasets.recipes.recipe import Recipe
from datasets.recipes.several_cameras import filmed_by
from datasets.tiff_frames import FrameStackWriter, TiffFrames, write_stack
from datasets.truth_files import MASK_BITS, MASKS_FILE
from synth.plan import SequencePlan
from synth.rendering.exposure import Optics, background_light, compose
from synth.rendering.parts import Parts
from synth.rendering.sensor import Picture, Sensor
from synth.rendering.shooting import toned
from synth.rendering.shots import READ_OUT, Shot, hsv_optics, picture_stream, rig_optics
from synth.rendering.tracer import Traced
from synth.rendering.window import whole_picture

BACKGROUND_EXPOSURES = 16
COVERED = 0.5
"""A mask holds the pixels that the particle covers for at least this share of area and time."""
FURTHER_SENSOR = 1_000_000
"""Beyond all numbers of the rig's cameras."""
FIXED_PATTERN = 1_000_003
"""Key of the fixed patterns' streams, beyond all sequence numbers."""


def sensor_of(optics: Optics, recipe: Recipe, camera: int) -> Sensor:
    """The sensor of camera ``camera``: 0 the high-speed camera, 1 + k camera k of the rig, ``FURTHER_SENSOR`` + k a further one."""
    seed = np.random.SeedSequence([recipe.seed, FIXED_PATTERN], spawn_key=(camera,))
    return Sensor(recipe.sensor, optics.intrinsics.width_px, optics.intrinsics.height_px, seed)


@dataclass(frozen=True)
class Taken:
    """Sequence ``index`` of ``recipe``, as planned, and its rendered ``parts``; ``plate``: what the plate alone adds to the picture.

    ``camera``: number of the high-speed camera; plan and recipe are those that it films.
    """

    plan: SequencePlan
    recipe: Recipe
    index: int
    parts: Parts
    plate: Traced | None = None
    camera: int = 0

    def by(self, camera: int) -> "Taken":
        """The same as another high-speed camera films it."""
        return replace(self, plan=self.plan.by_camera[camera], recipe=filmed_by(self.recipe, camera), camera=camera)


def record_frames(taken: Taken, shots: Sequence[Shot], folder: Path) -> TiffFrames:
    """Write a high-speed camera's frames and its background to ``folder``."""
    name = taken.plan.hsv.name
    optics = hsv_optics(taken.plan, taken.recipe)
    camera = _Camera(optics, sensor_of(optics, taken.recipe, _sensor_number(taken.camera)), taken, taken.plate)
    path, background_path = folder / frames_file(name), folder / background_file(name)
    write_stack(background_path, [camera.background("frame background", 0)])
    with FrameStackWriter(path) as frames:
        for shot in shots:
            frames.append(camera.picture(shot))
    return TiffFrames(path, taken.recipe.sensor.bit_depth, background_path)


def _sensor_number(camera: int) -> int:
    return 0 if camera == 0 else FURTHER_SENSOR + camera


def record_views(taken: Taken, shots: Sequence[Shot], folder: Path) -> TiffFrames:
    """Write the calibrated views and one background per rig camera to ``folder``."""
    rig = rig_optics(taken.plan, taken.recipe)
    cameras = {number: _Camera(optics, sensor_of(optics, taken.recipe, 1 + number), taken) for number, optics in rig.items()}
    path, background_path = folder / VIEWS_FILE, folder / VIEWS_BACKGROUND_FILE
    write_stack(background_path, [camera.background("view background", number) for number, camera in cameras.items()])
    with FrameStackWriter(path) as views:
        for shot, view in zip(shots, taken.plan.views, strict=True):
            views.append(cameras[view.camera].picture(shot))
    pages = tuple(list(cameras).index(view.camera) for view in taken.plan.views)
    return TiffFrames(path, taken.recipe.sensor.bit_depth, background_path, pages)


def record_masks(taken: Taken, shots: Sequence[Shot], folder: Path) -> TiffFrames:
    """Write the silhouettes of the frames to ``folder``, 0 or 1 per pixel; what lies before or behind a plate is none."""
    camera = taken.plan.hsv.intrinsics
    path = folder / MASKS_FILE
    with FrameStackWriter(path, compression="zlib") as masks:
        for shot in shots:
            mask = np.zeros((camera.height_px, camera.width_px), dtype=np.uint16)
            beside = 0.0 if taken.plate is None else taken.plate.coverage[shot.window.slices]
            mask[shot.window.slices] = taken.parts.load(shot).coverage - beside >= COVERED
            masks.append(mask)
    return TiffFrames(path, MASK_BITS)


class _Camera:
    """Optics and sensor of one camera, with its static background at hand."""

    def __init__(self, optics: Optics, sensor: Sensor, taken: Taken, plate: Traced | None = None) -> None:
        self._optics, self._sensor, self._taken = optics, sensor, taken
        self._open = background_light(optics)
        self._light = self._open if plate is None else compose(optics, self._open, whole_picture(optics.intrinsics), plate)

    def picture(self, shot: Shot) -> Picture:
        light = compose(self._optics, self._open, shot.window, self._taken.parts.load(shot))
        if self._light is not self._open:
            beside, light = light, self._light.copy()
            light[shot.window.slices] = beside[shot.window.slices]
        if shot.kind == "frame":
            light = toned(light, self._light, self._taken.plan.effects, self._optics)
        return self._sensor.read_out(light, self._rng(shot.kind, shot.number))

    def background(self, what: str, number: int) -> Picture:
        return self._sensor.average(self._light, BACKGROUND_EXPOSURES, self._rng(what, number))

    def _rng(self, what: str, number: int) -> np.random.Generator:
        return np.random.default_rng(
            picture_stream(self._taken.recipe, self._taken.index, what, number, READ_OUT, camera=self._taken.camera)
        )
