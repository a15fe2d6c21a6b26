"""Recordings written as cameras' programs write them: for round trips, for examples, and to hand pictures to other programs.

``.cine`` of 8, 16, packed 10 and packed 12 bit, ``.mraw`` with its ``.cih`` of 8, packed 12 and 16 bit, films in FFV1. Only the fields that
readers need are there. Time stamps of a ``.cine`` are kept to 2^-30 s, since its two lowest bits are flags.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.atomic_files import written_whole
from datasets.video import phantom
from datasets.video.header import Picture
from datasets.video.packing import packed
from datasets.video.phantom_table import LINEAR_DN

SETUP_BYTES = phantom.EXACT_RATE + 8
TRIGGER = 1_700_000_000 << 32
"""A second since 1970, in 2^-32 s."""


@dataclass(frozen=True)
class Recorded:
    """How pictures were taken: ``rate_hz``, ``exposure_s`` of each, ``depth`` bits that carry signal, ``first`` picture's number."""

    rate_hz: float
    exposure_s: float
    depth: int = 12
    first: int = 0


def write_cine(path: Path, pictures: Sequence[Picture], how: Recorded, *, bits: int, stamps_s: NDArray[np.float64] | None = None) -> None:
    """Write ``pictures`` (height, width) as a ``.cine`` of ``bits`` per pixel (8, 16, or packed 10 or 12).

    ``stamps_s`` (frame,) s from the trigger; evenly spaced by the rate where they are not given. For packed 10 bit values have to be among
    those that the camera's curve has (:data:`datasets.video.phantom_table.LINEAR_DN`).
    """
    count, (height, width) = len(pictures), pictures[0].shape
    stamps = (how.first + np.arange(count)) / how.rate_hz if stamps_s is None else stamps_s
    blocks = _block(phantom.TIMES, b"".join(struct.pack("<Q", _time64(float(s))) for s in stamps), more=True)
    blocks += _block(phantom.EXPOSURES, struct.pack("<I", round(how.exposure_s * phantom.SECOND)) * count, more=False)
    bitmap_at, setup_at = phantom.FILE_HEADER.size, phantom.FILE_HEADER.size + phantom.BITMAP_HEADER.size
    places_at = setup_at + SETUP_BYTES + len(blocks)
    datas = [_stored(picture, bits) for picture in pictures]
    start = places_at + 8 * count
    places = [start + k * (8 + len(datas[0])) for k in range(count)]
    packing = {10: phantom.PACKED_10, 12: phantom.PACKED_12}.get(bits, phantom.PLAIN)
    head = phantom.FILE_HEADER.pack(b"CI", 44, 0, 1, how.first, count, how.first, count, bitmap_at, setup_at, places_at, TRIGGER)
    bitmap = phantom.BITMAP_HEADER.pack(40, width, height, 1, 8 if bits == 8 else 16, packing, len(datas[0]), 0, 0, 0, 0)
    with written_whole(path) as temporary, temporary.open("wb") as stream:
        stream.write(head + bitmap + _setup(how, bits) + blocks + struct.pack(f"<{count}Q", *places))
        for data in datas:
            stream.write(struct.pack("<II", 8, len(data)) + data)


def _time64(stamp_s: float) -> int:
    step = phantom.FLAGS + 1
    return TRIGGER + step * round(stamp_s * phantom.SECOND / step)


def _block(kind: int, data: bytes, *, more: bool) -> bytes:
    return struct.pack("<IHH", len(data) + 8, kind, int(more)) + data


def _setup(how: Recorded, bits: int) -> bytes:
    setup = bytearray(SETUP_BYTES)
    setup[phantom.SETUP_MARK : phantom.SETUP_LENGTH] = b"ST"
    struct.pack_into("<H", setup, phantom.SETUP_LENGTH, SETUP_BYTES)
    struct.pack_into("<I", setup, phantom.RATE, round(how.rate_hz))
    struct.pack_into("<I", setup, phantom.SHUTTER_NS, round(1e9 * how.exposure_s))
    struct.pack_into("<I", setup, phantom.REAL_BITS, bits if bits in (8, 10) else how.depth)
    struct.pack_into("<d", setup, phantom.EXACT_RATE, how.rate_hz)
    return bytes(setup)


def _stored(picture: Picture, bits: int) -> bytes:
    """A picture as it lies in a ``.cine``: whole bytes bottom row first and filled up to four bytes, packed ones top row first."""
    if bits == 10:
        return packed(np.searchsorted(LINEAR_DN, picture).astype(np.uint16), 10)
    if bits == 12:
        return packed(picture, 12)
    rows = picture[::-1].astype("<u2" if bits == 16 else "u1")
    unfilled = rows.view(np.uint8).reshape(len(rows), -1)
    return np.pad(unfilled, ((0, 0), (0, -unfilled.shape[1] % 4))).tobytes()


def write_mraw(path: Path, pictures: Sequence[Picture], how: Recorded, *, bits: int) -> None:
    """Write ``pictures`` (height, width) as a ``.mraw`` of ``bits`` per pixel (8, packed 12 or 16), and its ``.cih`` beside it."""
    with written_whole(path) as temporary, temporary.open("wb") as stream:
        for picture in pictures:
            stream.write(packed(picture, bits) if bits in (10, 12) else picture.astype("<u2" if bits == 16 else "u1").tobytes())
    height, width = pictures[0].shape
    told = {
        "Record Rate(fps)": f"{how.rate_hz!r}",
        "Shutter Speed(s)": f"{how.exposure_s!r}",
        "Total Frame": len(pictures),
        "Start Frame": how.first,
        "Image Width": width,
        "Image Height": height,
        "Color Type": "Mono",
        "Color Bit": bits,
        "File Format": "MRaw",
        "EffectiveBit Depth": min(bits, how.depth),
        "EffectiveBit Side": "Lower",
    }
    with written_whole(path.with_suffix(".cih")) as temporary:
        temporary.write_text(
            "#Camera Information Header\n" + "".join(f"{key} : {value}\n" for key, value in told.items()), encoding="utf-8"
        )


def write_film(path: Path, pictures: Sequence[Picture], rate_hz: float, *, bits: int, codec: str = "FFV1") -> None:
    """Write ``pictures`` (height, width) as a grey film of 8 or 16 ``bits``; FFV1 loses nothing."""
    height, width = pictures[0].shape
    grey = [cv2.VIDEOWRITER_PROP_IS_COLOR, 0, cv2.VIDEOWRITER_PROP_DEPTH, cv2.CV_16U if bits == 16 else cv2.CV_8U]
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter_fourcc(*codec), rate_hz, (width, height), grey)
    for picture in pictures:
        writer.write(picture.astype(np.uint16 if bits == 16 else np.uint8))
    writer.release()
