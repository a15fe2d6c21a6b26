"""What one camera recorded, of whatever kind the user has it: pictures of a camera's file, masks, or outlines."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import Recording
from datasets.outline_files import read_outlines
from datasets.video import Header, Origin, open_video
from datasets.vocabulary.outline import Outline
from estimator.outlines.masks import outline_of_mask
from estimator.outlines.standing import ghost_px
from tumble.importing.clip import Clip, background_picture, clip_of, median_picture
from tumble.importing.request import Request, Value

FIRST = "first:"
COMPARED = 12
"""Pictures, spread over the recording, that a background is compared with."""


@dataclass(frozen=True)
class Source:
    """The ``recording`` that ``path`` holds, its pictures' numbers ``frames`` in the file, and what is said of it.

    ``header`` and ``size_px`` (width, height) are ``None`` for outlines, whose file says neither.
    """

    path: Path
    recording: Recording
    frames: range
    header: Header | None
    size_px: tuple[int, int] | None
    values: tuple[Value, ...]
    remarks: tuple[str, ...] = ()


def source_of(path: Path, request: Request, *, decode: bool = True) -> Source:
    """The source of one camera; without ``decode`` no picture is read, for a look at the header.

    Raises
    ------
    InputError
        Naming the file.
    """
    if path.suffix.lower() == ".npz":
        return _outlines(path, request)
    clip, depth = clip_of(open_video(path), request.frames, request.bits, decode=decode)
    header = clip.video.header
    values, remarks = [*_of_header(path, header, clip), Value("bit_depth", f"{depth.value} bit", depth.value, depth.origin, depth.note)], []
    remarks += [remark for remark in (header.lossy, header.remark) if remark]
    if request.masks:
        outlines = _of_masks(clip) if decode else ()
        values.append(Value("outlines", "of masks", "masks", Origin.GIVEN, "--masks"))
        return Source(path, outlines, range(clip.start, clip.stop), header, _size(header), tuple(values), tuple(remarks))
    background, said = _background(clip, request.background) if decode else (None, _background_value(request.background))
    values.append(said)
    clip = replace(clip, taken_background=background)
    return Source(path, clip, range(clip.start, clip.stop), header, _size(header), tuple(values), tuple(remarks))


def _size(header: Header) -> tuple[int, int]:
    return header.width_px, header.height_px


def _of_header(path: Path, header: Header, clip: Clip) -> list[Value]:
    size = f"{header.width_px} x {header.height_px} px"
    taken = f"{clip.start}:{clip.stop} of {header.count}"
    whole = len(clip) == header.count
    values = [
        Value("video", str(path), str(path.resolve()), Origin.GIVEN),
        Value("kind", header.kind, header.kind, Origin.READ),
        Value("picture_size", size, [float(header.width_px), float(header.height_px)], Origin.READ),
        Value("frames", taken, taken, Origin.READ if whole else Origin.GIVEN, "all" if whole else "--frames"),
    ]
    if header.playback_hz is not None:
        rate = Value("playback_rate", f"{header.playback_hz:g} Hz", header.playback_hz, Origin.READ, "of the film; not the camera's")
        values.append(rate)
    if header.trigger is not None:
        values.append(Value("trigger", header.trigger.value, header.trigger.value, header.trigger.origin, header.trigger.note))
    return values


def _of_masks(clip: Clip) -> tuple[Outline, ...]:
    pictures = (clip.read(k) for k in range(len(clip)))
    full = float(max(int(picture.max()) for picture in pictures))
    return tuple(outline_of_mask(clip.read(k), full=full) for k in range(len(clip)))


def _outlines(path: Path, request: Request) -> Source:
    found = read_outlines(path)
    start, stop = request.frames[0] or 0, len(found) if request.frames[1] is None else request.frames[1]
    if not 0 <= start < stop <= len(found):
        raise InputError(f"{path}: --frames {start}:{stop}: expected outlines of 0:{len(found)}, which the file has.")
    taken = f"{start}:{stop} of {len(found)}"
    values = (
        Value("outlines", str(path), str(path.resolve()), Origin.GIVEN),
        Value("frames", taken, taken, Origin.READ if len(found) == stop - start else Origin.GIVEN),
    )
    return Source(path, found[start:stop], range(start, stop), None, None, values)


def _background_value(said: str) -> Value:
    if said == "auto":
        note = "modelled from pictures of the recording, each without its objects"
        return Value("background", "auto", "auto", Origin.ASSUMED, note)
    return Value("background", said, said if said.startswith(FIRST) else str(Path(said).resolve()), Origin.GIVEN, "--background")


def _background(clip: Clip, said: str) -> tuple[NDArray[np.uint16] | None, Value]:
    """The background picture (height, width) DN as asked for, ``None`` where it is to be modelled.

    Raises
    ------
    InputError
        Where it is of another size, or shows a particle that stood still.
    """
    if said == "auto":
        return None, _background_value(said)
    if said.startswith(FIRST):
        background = median_picture(clip.read, _count(said, len(clip)))
    else:
        background = background_picture(Path(said))
    header = clip.video.header
    if background.shape != (header.height_px, header.width_px):
        raise InputError(
            f"--background {said}: expected {header.width_px} x {header.height_px} px as {clip.video.path} has, "
            f"got {background.shape[1]} x {background.shape[0]}."
        )
    compared = np.unique(np.linspace(0, len(clip) - 1, min(COMPARED, len(clip))).astype(int))
    ghost = ghost_px(background, [clip.read(int(k)) for k in compared])
    if ghost is not None:
        raise InputError(
            f"{clip.video.path}: --background {said}: expected a background without the particle, got one that shows something at "
            f"({ghost[0]:.0f}, {ghost[1]:.0f}) px that later pictures do not: a particle that stands still is not background. "
            "Take pictures without it (--background FILE), or --background auto."
        )
    return background, _background_value(said)


def _count(said: str, most: int) -> int:
    number = said.removeprefix(FIRST)
    if not number.isdecimal() or not 1 <= int(number) <= most:
        raise InputError(f"--background {said}: expected first:N with N from 1 to {most}, the number of pictures taken.")
    return int(number)
