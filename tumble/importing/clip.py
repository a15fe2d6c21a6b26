"""The pictures of a recording that are taken, as an observation has them: a range, a bit depth, a background."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.video import Origin, Stated, Video, open_video
from datasets.video.images import SUFFIXES, TIFF_SUFFIXES, read_image

Picture = NDArray[np.uint16]
DEPTHS = (8, 10, 12, 14, 16)
MOST_MEDIAN_PICTURES = 25
"""Of a recording that is a background: enough for a median of noise, few enough for the memory."""


@dataclass(frozen=True)
class Clip:
    """Pictures ``start`` to ``stop`` (excluded) of a video; implements :class:`datasets.observation.Frames`."""

    video: Video
    start: int
    stop: int
    bit_depth: int
    taken_background: Picture | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return self.stop - self.start

    def read(self, index: int) -> Picture:
        """Picture ``index``, (height, width) DN."""
        number = index % len(self)
        picture = self.video.read(self.start + number)
        if int(picture.max()) >= 1 << self.bit_depth:
            raise InputError(
                f"{self.video.path}: frame {self.start + number}: expected values of {self.bit_depth} bit, got {int(picture.max())}; "
                "state the right --bits."
            )
        return picture

    def background(self) -> Picture | None:
        """The picture without the particle, where one was taken."""
        return self.taken_background

    def background_of(self, index: int) -> Picture | None:
        """The same for all."""
        return self.taken_background


def clip_of(video: Video, frames: tuple[int | None, int | None], bits: int | None, *, decode: bool = True) -> tuple[Clip, Stated[int]]:
    """The clip of a video without a background, and its bit depth with where that is from; without ``decode`` no picture is read.

    Raises
    ------
    InputError
        Where the recording has no such pictures.
    """
    count = video.header.count
    start, stop = frames[0] or 0, count if frames[1] is None else frames[1]
    if not 0 <= start < stop <= count:
        raise InputError(f"{video.path}: --frames {start}:{stop}: expected pictures of 0:{count}, which the recording has.")
    depth = _depth(video, range(start, stop) if decode else range(0), bits)
    return Clip(video, start, stop, depth.value), depth


def _depth(video: Video, frames: range, bits: int | None) -> Stated[int]:
    """As given, as read or, where the file only says how many bits hold a value, the fewest usual ones that hold the largest value."""
    if bits is not None:
        return Stated(bits, Origin.GIVEN, "--bits")
    stated = video.header.bit_depth
    if stated.origin is not Origin.ASSUMED or not frames:
        return stated
    largest = max(int(video.read(k).max()) for k in frames)
    depth = next(d for d in DEPTHS if largest < 1 << d)
    return Stated(depth, Origin.ASSUMED, f"{stated.note}; the largest value is {largest}. State --bits if it is another")


def background_picture(path: Path) -> Picture:
    """A background (height, width) DN from a picture's file, or the median of a recording of it.

    Raises
    ------
    InputError
        Naming the file.
    """
    if path.suffix.lower() in SUFFIXES:
        return read_image(path)
    video = open_video(path)
    if path.suffix.lower() in TIFF_SUFFIXES and video.header.count == 1:
        return video.read(0)
    return median_picture(video.read, video.header.count)


def median_picture(read: Callable[[int], Picture], count: int) -> Picture:
    """The median of the first ``count`` pictures, pixel by pixel (DN, rounded); of some spread over them where they are many."""
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_MEDIAN_PICTURES)).astype(int))
    return np.asarray(np.rint(np.median(np.stack([read(int(k)) for k in chosen]), axis=0)), dtype=np.uint16)
