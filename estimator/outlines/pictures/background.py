"""The picture that a camera would have taken without the particle.

Where one was taken it is used. Otherwise it is the mean of up to ``background_samples`` frames spread over the
sequence, each with its objects masked out. Frames that are saturated, or far darker or brighter than the others (a lamp that was off),
are no samples: a single one would decide what lies behind a slow particle. What was covered in every one of them is filled in from the
smooth illumination (a slow particle) or kept as it is where it touches the picture's edge (scenery: a plate, a needle).
A changing lamp is no matter here: frames are compared with the background through a ratio fitted around the particle.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import Frames
from estimator.outlines.pictures.illumination import fitted_surface, illumination_of

Picture = Float[NDArray[np.float32], "height width"]
Mask = Bool[NDArray[np.bool_], "height width"]
ALIKE = 2.0
"""Frames whose brightness differs by more than this factor from the usual one say nothing of the background."""
SATURATED = 0.99
"""Share of full scale from which a whole picture counts as saturated."""


@dataclass(frozen=True)
class Background:
    """``level`` (DN) without the particle and its median ``typical``; ``bright``: the particle is darker than it.

    ``full_scale`` is the sensor's (DN).
    """

    level: Picture
    typical: float
    bright: bool
    full_scale: float

    @property
    def dim(self) -> float:
        """Level (DN) below which a bright background carries too little light to see anything against it."""
        return 0.25 * self.typical if self.bright else -np.inf

    @property
    def range_dn(self) -> float:
        """The greatest contrast possible (DN)."""
        return max(self.typical if self.bright else self.full_scale - self.typical, 1.0)


def background(level: Picture, bright: bool, bit_depth: int) -> Background:
    """A background of this ``level`` (DN) on a sensor of ``bit_depth``."""
    return Background(level, float(np.median(level[::8, ::8])), bright, float(2**bit_depth - 1))


def read_picture(frames: Frames, index: int, *, name: str, shape: tuple[int, int] | None = None) -> NDArray[np.uint16]:
    """Frame ``index``; raises :class:`InputError` naming ``name`` and the frame where its size is not ``shape``."""
    picture = np.asarray(frames.read(index))
    _check_shape(picture, shape, f"{name}: frame {index}")
    return picture


def background_of_sequence(frames: Frames, *, name: str, shape: tuple[int, int], samples: int) -> Background:
    """The background of a sequence, measured if there is one and modelled otherwise."""
    chosen = np.unique(np.linspace(0, len(frames) - 1, min(samples, len(frames))).astype(int))
    taken = frames.background()
    if taken is None:
        return _modelled([int(i) for i in chosen], frames, name=name, shape=shape)
    few = [read_picture(frames, int(i), name=name, shape=shape) for i in chosen[:: max(1, len(chosen) // 4)]]
    return measured(taken, few, frames.bit_depth, name=f"{name}: background")


def measured(taken: NDArray[np.uint16], pictures: list[NDArray[np.uint16]], bit_depth: int, *, name: str) -> Background:
    """A background that was taken (DN); ``pictures`` with the particle say whether it is the darker one.

    Raises :class:`InputError` naming ``name`` where it is not of the pictures' size.
    ``taken``, ``pictures`` (height, width) DN.
    """
    _check_shape(taken, pictures[0].shape, name)
    level = np.asarray(taken, dtype=np.float32)
    return background(level, sum(_imbalance(p, level) for p in pictures) <= 0, bit_depth)


def background_of_picture(picture: NDArray[np.uint16], bit_depth: int) -> Background:
    """The smooth background of a picture that comes alone; ``picture`` (height, width) DN."""
    light = illumination_of(picture.astype(np.float32))
    return background(light.level, light.bright, bit_depth)


def _modelled(chosen: list[int], frames: Frames, *, name: str, shape: tuple[int, int]) -> Background:
    total, count, plain = np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    bright = 0
    levels = [_typical(read_picture(frames, index, name=name, shape=shape)) for index in chosen]
    chosen = _alike(chosen, levels, SATURATED * (2**frames.bit_depth - 1))
    for index in chosen:
        picture = read_picture(frames, index, name=name, shape=shape).astype(np.float32)
        light = illumination_of(picture)
        total += np.where(light.objects, 0, picture)
        count += ~light.objects
        plain += picture
        bright += 1 if light.bright else -1
    mean = np.where(count > 0, total / np.maximum(count, 1), plain / len(chosen)).astype(np.float32)
    return background(_filled_in(mean, count > 0), bright >= 0, frames.bit_depth)


def _typical(picture: NDArray[np.uint16]) -> float:
    return float(np.median(picture[::8, ::8]))


def _alike(chosen: list[int], levels: list[float], saturated: float) -> list[int]:
    """Those of ``chosen`` whose brightness (DN) is within ``ALIKE`` times the usual one and below ``saturated``; all, where none is."""
    usual = float(np.median([level for level in levels if level < saturated] or levels))
    good = [usual / ALIKE <= level <= usual * ALIKE and level < saturated for level in levels]
    return [index for index, kept in zip(chosen, good, strict=True) if kept] or chosen


def _filled_in(mean: Picture, seen: Mask) -> Picture:
    """``mean`` with never-seen areas away from the picture's edge replaced by a smooth surface."""
    labels, stats = cv2.connectedComponentsWithStats((~seen).astype(np.uint8), connectivity=8)[1:3]
    height, width = mean.shape
    left, top, wide, high = stats[:, 0], stats[:, 1], stats[:, 2], stats[:, 3]
    scenery = (left <= 0) | (top <= 0) | (left + wide >= width) | (top + high >= height)
    scenery[0] = True
    covered = ~scenery[labels]
    if not covered.any():
        return mean
    return np.where(covered, _surface(mean, seen), mean)


def _surface(mean: Picture, seen: Mask) -> Picture:
    """The smooth surface through the ``seen`` pixels, fitted on a coarser grid."""
    step = max(1, min(mean.shape) // 128)
    coarse = fitted_surface(mean[::step, ::step], seen[::step, ::step])
    shift = np.array([[step, 0, 0], [0, step, 0]], np.float32)
    size = (mean.shape[1], mean.shape[0])
    flags = cv2.INTER_LINEAR
    return np.asarray(cv2.warpAffine(coarse, shift, size, flags=flags, borderMode=cv2.BORDER_REPLICATE), dtype=np.float32)


def _imbalance(picture: NDArray[np.uint16], level: Picture) -> float:
    """Sum of the strong departures of ``picture`` from the background's ``level``; negative where the particle is darker."""
    departure = picture[::4, ::4] - level[::4, ::4]
    departure = departure - np.median(departure)
    strong = np.abs(departure) > 6 * 1.4826 * np.median(np.abs(departure)) + 1.0
    return float(departure[strong].sum())


def _check_shape(picture: NDArray[np.generic], shape: tuple[int, int] | None, what: str) -> None:
    if picture.ndim != 2 or (shape is not None and picture.shape != shape):
        wanted = "a grey picture (height, width)" if shape is None else f"{shape[1]} x {shape[0]} px (width x height), as its camera says"
        raise InputError(f"{what}: expected {wanted}, got an array of shape {picture.shape}")
