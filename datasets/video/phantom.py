"""Phantom ``.cine`` files: 8 and 16 bit, and packed 10 and 12 bit.

A file has a header, a Windows bitmap header, the camera's setup, blocks of time stamps and exposures, and a table of where each picture
begins. Pictures of whole bytes lie bottom row first, as in a bitmap, packed ones top row first. Time stamps count seconds in 2^-32 s, the
two lowest bits being flags. [Vision Research, "The CINE File Format"; the same fields in soft-matter/pims, cine.py (BSD)].

Read here in own code: pycine is GPL; pims reads no packed colours, shifts 10 bit without the camera's curve and believes every size that a
file states; cine-handler knows no packed 12 bit and unpacks in a compiled library without source.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.video.header import (
    FASTEST_HZ,
    LONGEST_S,
    SLOWEST_HZ,
    Header,
    Moment,
    Origin,
    Picture,
    Stated,
    check_size,
    read_positive,
    read_rate,
)
from datasets.video.packing import packed_size, unpacked
from datasets.video.phantom_table import LINEAR_DN

PLAIN, PACKED_10, PACKED_12 = 0, 256, 1024
"""``biCompression`` of the bitmap header."""
FILE_HEADER, BITMAP_HEADER = struct.Struct("<2sHHHiIiIIIIQ"), struct.Struct("<IiiHHIIiiII")
SETUP_MARK, SETUP_LENGTH, RATE, SHUTTER, COLOURS, REAL_BITS, SHUTTER_NS, EXACT_RATE = 140, 142, 768, 772, 808, 896, 1568, 10400
"""Places (bytes) in the setup: mark, length, pictures per second, exposure (us), kind of colour mosaic, bits that carry signal, exposure
(ns), pictures per second as a double. Older setups end before the last ones."""
TIMES, EXPOSURES, RANGE_DATA = 1002, 1003, 1004
"""Kinds of blocks. Readers are to stop at range data, whose length is not stated right."""
SECOND = 2.0**32
FLAGS = 3
MOST_BLOCKS = 100
"""A file has fewer than ten kinds."""


@dataclass(frozen=True)
class Cine:
    """The pictures of a ``.cine`` file; ``places`` (count,) bytes: where each begins. ``bits``: stored per pixel (8, 16, 10 or 12).

    ``upwards``: the bottom row lies first, as in a bitmap whose height is stated positive.
    """

    path: Path
    header: Header
    places: NDArray[np.uint64]
    bits: int
    upwards: bool

    def read(self, index: int) -> Picture:
        """Picture ``index``, (height, width) DN; see :class:`datasets.video.header.Video`."""
        where = f"{self.path}: frame {index}"
        try:
            with self.path.open("rb") as stream:
                data = _payload(stream, int(self.places[index]), where, self._sizes)
        except OSError as error:
            raise InputError(f"{where} cannot be read ({error.strerror}).") from error
        shape = (self.header.height_px, self.header.width_px)
        if self.bits in (10, 12):
            values = unpacked(data, shape[0] * shape[1], self.bits).reshape(shape)
            return LINEAR_DN[values] if self.bits == 10 else values
        rows = data.reshape(shape[0], -1)[:, : shape[1] * self.bits // 8]
        plain: Picture = np.ascontiguousarray(rows).view("<u2" if self.bits == 16 else "u1").astype(np.uint16)
        plain = plain[::-1] if self.upwards else plain
        if self.bits == 16 and int(plain.max()) >= 1 << self.header.bit_depth.value:
            raise InputError(f"{where}: expected values of {self.header.bit_depth.value} bit, as the setup says, got {int(plain.max())}.")
        return plain

    @property
    def _sizes(self) -> tuple[int, ...]:
        return picture_sizes(self.header.width_px, self.header.height_px, self.bits)


def picture_sizes(width_px: int, height_px: int, bits: int) -> tuple[int, ...]:
    """Bytes that a picture may take: rows end at whole bytes, or at a multiple of four as in a bitmap."""
    if bits in (10, 12):
        return (packed_size(width_px * height_px, bits),)
    row = width_px * bits // 8
    return (row * height_px, -(-row // 4) * 4 * height_px)


def read_cine(path: Path) -> Cine:
    """Open a ``.cine`` file: headers and tables are read and checked, pictures when they are asked for.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as stream:
            return _opened(path, stream, size)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except OSError as error:
        raise InputError(f"{path}: expected a .cine file, got one that cannot be read ({error.strerror}).") from error


def _opened(path: Path, stream: BinaryIO, size: int) -> Cine:
    mark, _, coding, version, _, _, first, count, bitmap_at, setup_at, places_at, trigger = _fields(path, stream, FILE_HEADER, 0, size)
    if mark != b"CI" or version not in (0, 1):
        raise InputError(f"{path}: expected a .cine file (its first letters are CI, its version 0 or 1), got {mark!r}, version {version}.")
    if coding != 0:
        what = {1: "JPEG", 2: "a colour camera's mosaic"}.get(coding, f"coding {coding}")
        raise InputError(f"{path}: expected uncompressed grey pictures, got {what}; save them from the camera's program as raw grey .cine.")
    _, width, height, planes, bit_count, packing, *_ = _fields(path, stream, BITMAP_HEADER, bitmap_at, size)
    check_size(path, width, abs(height), count)
    bits = _stored_bits(path, bit_count, packing, planes)
    places = _places(path, stream, (places_at, count, version), size)
    setup, blocks_at = _setup(path, stream, setup_at, size)
    if _number(setup, COLOURS):
        raise InputError(f"{path}: expected a grey camera's pictures, got a colour camera's mosaic (CFA {_number(setup, COLOURS)}).")
    blocks = dict(_blocks(stream, blocks_at, min(places_at, size), count))
    header = Header(
        kind=f"Phantom .cine, {'packed ' if bits in (10, 12) else ''}{bits} bit",
        width_px=width,
        height_px=abs(height),
        count=count,
        bit_depth=_depth(path, bits, setup),
        rate_hz=_rate(path, setup),
        exposure_s=_exposure(path, setup, blocks),
        stamps_s=_stamps(path, blocks, trigger),
        stamped=Stated(Moment.START, Origin.ASSUMED, "the file does not say; all times shift alike, velocities do not change"),
        first=first,
        trigger=Stated(f"between the camera's pictures -1 and 0; the first one here is {first}", Origin.READ, "header"),
    )
    return Cine(path, header, places, bits, height > 0)


def _fields(path: Path, stream: BinaryIO, layout: struct.Struct, at: int, size: int) -> tuple[Any, ...]:
    if at + layout.size > size:
        raise InputError(
            f"{path}: expected a header of {layout.size} bytes at byte {at}, got {size} bytes in all; it is cut off or damaged."
        )
    stream.seek(at)
    return layout.unpack(stream.read(layout.size))


def _stored_bits(path: Path, bit_count: int, packing: int, planes: int) -> int:
    found = {(8, PLAIN): 8, (16, PLAIN): 16, (16, PACKED_10): 10, (16, PACKED_12): 12}.get((bit_count, packing))
    if found is None or planes != 1:
        raise InputError(
            f"{path}: expected grey pictures of 8 or 16 bit, or packed 10 or 12 bit, got {bit_count} bit, packing {packing}, "
            f"{planes} planes."
        )
    return found


def _places(path: Path, stream: BinaryIO, table: tuple[int, int, int], size: int) -> NDArray[np.uint64]:
    """Where the pictures begin (count,) bytes; ``table``: where that is written, the count, the file's version."""
    at, count, version = table
    width = 8 if version == 1 else 4
    if at + count * width > size:
        raise InputError(f"{path}: expected places of {count} pictures from byte {at}, got {size} bytes in all; it is cut off or damaged.")
    stream.seek(at)
    places = np.frombuffer(stream.read(count * width), f"<u{width}").astype(np.uint64)
    beyond = np.flatnonzero(places >= size)
    if len(beyond):
        raise InputError(f"{path}: frame {beyond[0]}: expected it to begin before byte {size}, the file's end, got {places[beyond[0]]}.")
    return places


def _setup(path: Path, stream: BinaryIO, at: int, size: int) -> tuple[bytes, int]:
    """The camera's setup, and where the blocks behind it begin (byte)."""
    stream.seek(min(at, size))
    data = stream.read(EXACT_RATE + 8)
    if data[SETUP_MARK:SETUP_LENGTH] != b"ST" or len(data) < REAL_BITS + 4:
        raise InputError(f"{path}: expected the camera's setup at byte {at}, got something else; the file is cut off or damaged.")
    length = int.from_bytes(data[SETUP_LENGTH : SETUP_LENGTH + 2], "little")
    return data[:length], at + length


def _number(setup: bytes, at: int) -> int:
    """Four bytes of the setup; 0 where it is older and ends before."""
    return int.from_bytes(setup[at : at + 4], "little")


def _blocks(stream: BinaryIO, at: int, end: int, count: int) -> Iterator[tuple[int, bytes]]:
    """Kind and content of the blocks of times and exposures between bytes ``at`` and ``end``."""
    for _ in range(MOST_BLOCKS):
        if at + 8 > end:
            return
        stream.seek(at)
        size, kind, more = struct.unpack("<IHH", stream.read(8))
        if size < 8 or kind == RANGE_DATA:
            return
        wanted = {TIMES: 8, EXPOSURES: 4}.get(kind)
        if wanted is not None and at + size <= end and size - 8 == wanted * count:
            yield kind, stream.read(size - 8)
        if not more:
            return
        at += size


def _depth(path: Path, bits: int, setup: bytes) -> Stated[int]:
    if bits == 8:
        return Stated(8, Origin.READ, "bitmap header")
    if bits == 10:
        return Stated(12, Origin.READ, "packed 10 bit, which the camera's curve makes 12")
    stated = _number(setup, REAL_BITS)
    if stated == 0 and bits == 12:
        return Stated(12, Origin.READ, "packed 12 bit")
    if not 8 <= stated <= 16:
        raise InputError(f"{path}: RealBPP: expected 8 to 16 bits that carry signal, got {stated}.")
    return Stated(stated, Origin.READ, "setup, RealBPP")


def _rate(path: Path, setup: bytes) -> Stated[float]:
    exact = struct.unpack_from("<d", setup, EXACT_RATE)[0] if len(setup) >= EXACT_RATE + 8 else 0.0
    if SLOWEST_HZ <= exact <= FASTEST_HZ:
        return Stated(exact, Origin.READ, "setup, dFrameRate")
    return Stated(read_rate(path, float(_number(setup, RATE))), Origin.READ, "setup, FrameRate")


def _exposure(path: Path, setup: bytes, blocks: dict[int, bytes]) -> Stated[float]:
    """From the block of exposures where all are alike to a thousandth, otherwise from the setup."""
    if EXPOSURES in blocks:
        each = np.frombuffer(blocks[EXPOSURES], "<u4") / SECOND
        if 0 < each.max() <= LONGEST_S:
            note = "" if np.ptp(each) <= 1e-3 * each.max() else f"; they differ, from {each.min():.3g} s on"
            return Stated(float(np.median(each)), Origin.READ, f"exposures of the pictures, median{note}")
    nanoseconds = _number(setup, SHUTTER_NS) or 1000 * _number(setup, SHUTTER)
    return Stated(read_positive(path, "exposure", 1e-9 * nanoseconds, "s", LONGEST_S), Origin.READ, "setup, Shutter")


def _stamps(path: Path, blocks: dict[int, bytes], trigger: int) -> Stated[NDArray[np.float64]] | None:
    if TIMES not in blocks:
        return None
    since = (np.frombuffer(blocks[TIMES], "<u8") & ~np.uint64(FLAGS)).astype(object) - (trigger & ~FLAGS)  # whole numbers: nothing is lost
    stamps = since.astype(np.float64) / SECOND
    if not np.all(np.diff(stamps) > 0):
        k = int(np.flatnonzero(~(np.diff(stamps) > 0))[0]) + 1
        raise InputError(f"{path}: frame {k}: expected time stamps that rise, got {stamps[k]:.9f} s after {stamps[k - 1]:.9f} s.")
    return Stated(stamps, Origin.READ, "time stamps of the pictures, from the trigger")


def _payload(stream: BinaryIO, at: int, where: str, sizes: tuple[int, ...]) -> NDArray[np.uint8]:
    """The bytes of the picture that begins at byte ``at``: an annotation that states its own length and, last, the picture's."""
    stream.seek(at)
    length = int.from_bytes(stream.read(4), "little")
    stream.seek(at + max(length, 8) - 4)
    size = int.from_bytes(stream.read(4), "little")
    if size not in sizes:
        raise InputError(f"{where}: expected {' or '.join(map(str, dict.fromkeys(sizes)))} bytes, got {size}; the file is damaged.")
    data = stream.read(size)
    if len(data) != size:
        raise InputError(f"{where} is cut off: expected {size} bytes from byte {at}, got {len(data)}.")
    return np.frombuffer(data, np.uint8)
