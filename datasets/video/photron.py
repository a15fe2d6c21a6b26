"""Photron ``.mraw`` with its ``.cihx`` or ``.cih``: 8, packed 10 and 12, and 16 bit, without a header in the pictures' file.

``.cihx`` is XML between two blocks of zeros, ``.cih`` lines of ``name : value``. Pictures lie after each other, top row first; pixels are
packed as in
:mod:`datasets.video.packing`. There are no time stamps: picture ``k`` was taken at ``(first + k skip) / rate`` from the trigger's
picture, ``first`` being the file's StartFrame. [Photron, "PFV4 user's manual"; fields as in ladisk/pyMRAW].

Read here in own code: pyMRAW is GPL, unpacks a whole recording into memory and believes every size that the header states.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.errors import InputError
from datasets.video.header import LONGEST_S, Header, Origin, Picture, Stated, check_size, read_positive, read_rate
from datasets.video.packing import packed_size, unpacked

SIDE_CARS = (".cihx", ".cih")
LARGEST_SIDE_CAR_BYTES = 2**22
"""The camera's program writes about 20 kB."""
STORED_BITS = (8, 10, 12, 16)
XML = {
    "width": "imageDataInfo/resolution/width",
    "height": "imageDataInfo/resolution/height",
    "bits": "imageDataInfo/colorInfo/bit",
    "colours": "imageDataInfo/colorInfo/type",
    "depth": "imageDataInfo/effectiveBit/depth",
    "side": "imageDataInfo/effectiveBit/side",
    "format": "imageFileInfo/fileFormat",
    "count": "frameInfo/totalFrame",
    "first": "frameInfo/startFrame",
    "skip": "frameInfo/skipFrame",
    "rate": "recordInfo/recordRate",
    "shutter": "recordInfo/shutterSpeed",
    "shutter_ns": "recordInfo/shutterSpeedNsec",
    "camera": "deviceInfo/deviceName",
}
"""Where a ``.cihx`` has a value."""
LINES = {
    "width": "Image Width",
    "height": "Image Height",
    "bits": "Color Bit",
    "colours": "Color Type",
    "depth": "EffectiveBit Depth",
    "side": "EffectiveBit Side",
    "format": "File Format",
    "count": "Total Frame",
    "first": "Start Frame",
    "skip": "Skip Frame",
    "rate": "Record Rate(fps)",
    "shutter": "Shutter Speed(s)",
    "camera": "Camera Type",
}
"""What a ``.cih`` calls it."""


@dataclass(frozen=True)
class Mraw:
    """The pictures of a ``.mraw`` file. ``bits``: stored per pixel (8, 10, 12, 16); ``shift``: unused low bits of each value."""

    path: Path
    header: Header
    bits: int
    shift: int

    def read(self, index: int) -> Picture:
        """Picture ``index``, (height, width) DN; see :class:`datasets.video.header.Video`."""
        where = f"{self.path}: frame {index}"
        shape = (self.header.height_px, self.header.width_px)
        size = picture_size(*shape, self.bits)
        try:
            with self.path.open("rb") as stream:
                stream.seek(index * size)
                data = np.frombuffer(stream.read(size), np.uint8)
        except OSError as error:
            raise InputError(f"{where} cannot be read ({error.strerror}).") from error
        if len(data) != size:
            raise InputError(f"{where} is cut off: expected {size} bytes, got {len(data)}.")
        values = unpacked(data, shape[0] * shape[1], self.bits) if self.bits in (10, 12) else data.view("<u2" if self.bits == 16 else "u1")
        picture: Picture = np.right_shift(values.astype(np.uint16).reshape(shape), np.uint16(self.shift))
        if int(picture.max()) >= 1 << self.header.bit_depth.value:
            depth = self.header.bit_depth.value
            raise InputError(f"{where}: expected values of {depth} bit, as its header says, got {int(picture.max())}.")
        return picture


def picture_size(height_px: int, width_px: int, bits: int) -> int:
    """Bytes of a picture."""
    pixels = height_px * width_px
    return packed_size(pixels, bits) if bits in (10, 12) else pixels * bits // 8


def read_mraw(path: Path) -> Mraw:
    """Open a ``.mraw`` file by its own name or by that of its ``.cihx`` or ``.cih``.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    side_car = path if path.suffix.lower() in SIDE_CARS else _beside(path, SIDE_CARS)
    pictures = path if path.suffix.lower() == ".mraw" else _beside(path, (".mraw",))
    told = _Told(side_car, _cihx(side_car) if side_car.suffix.lower() == ".cihx" else _cih(side_car))
    bits = told.whole("bits")
    if told.text("format", "mraw").lower() != "mraw" or "color" in told.text("colours", "").lower() or bits not in STORED_BITS:
        raise InputError(
            f"{side_car}: expected grey MRAW pictures of {', '.join(map(str, STORED_BITS))} bit, "
            f"got {told.text('format', '')} {told.text('colours', '')} of {bits} bit."
        )
    header = _header(told, bits)
    check_size(side_car, header.width_px, header.height_px, header.count)
    expected, size = header.count * picture_size(header.height_px, header.width_px, bits), pictures.stat().st_size
    if size < expected:
        said = f"{header.count} pictures, as {side_car.name} says"
        raise InputError(f"{pictures}: expected {expected} bytes ({said}), got {size}; it is cut off.")
    higher = told.text("side", "lower").lower() == "higher"
    return Mraw(pictures, header, bits, bits - header.bit_depth.value if higher else 0)


def _beside(path: Path, suffixes: tuple[str, ...]) -> Path:
    if not path.exists():
        raise InputError(f"{path}: there is no such file.")
    found = [other for other in sorted(path.parent.iterdir()) if other.stem == path.stem and other.suffix.lower() in suffixes]
    if not found:
        raise InputError(f"{path}: expected {' or '.join(path.stem + suffix for suffix in suffixes)} beside it, got none.")
    return found[-1]  # .cihx says more than .cih


@dataclass(frozen=True)
class _Told:
    """What the side-car says, as text, by the keys of :data:`XML`."""

    path: Path
    values: Mapping[str, str]

    def text(self, key: str, otherwise: str | None = None) -> str:
        found = self.values.get(key) or otherwise
        if found is None:
            raise InputError(f"{self.path}: expected {LINES.get(key, key)}, got none.")
        return found

    def whole(self, key: str, otherwise: int | None = None) -> int:
        text = self.text(key, None if otherwise is None else str(otherwise))
        if not re.fullmatch(r"[+-]?[0-9]{1,12}", text):
            raise InputError(f"{self.path}: {LINES.get(key, key)}: expected a whole number, got {text[:40]!r}.")
        return int(text)

    def number(self, key: str) -> float:
        """A number, or one over another as in ``1/5000``; a unit may follow."""
        text = self.text(key)
        found = re.fullmatch(r"([0-9.]{1,40}(?:[eE][+-]?[0-9]{1,4})?)(?:\s*/\s*([0-9.]{1,40}))?\s*(?:s|sec|fps|Hz)?", text)
        try:
            return float(found[1]) / float(found[2] or 1.0)  # type: ignore[index]
        except (TypeError, ValueError, ZeroDivisionError):
            raise InputError(f"{self.path}: {LINES.get(key, key)}: expected a number, got {text[:40]!r}.") from None


def _header(told: _Told, bits: int) -> Header:
    rate, skip, first = told.number("rate"), told.whole("skip", 1), told.whole("first", 0)
    if not 1 <= skip <= 10**6:
        raise InputError(f"{told.path}: skipFrame: expected 1 (every picture) or more, got {skip}.")
    read_rate(told.path, rate)
    read_rate(told.path, rate / skip)
    depth = told.whole("depth", bits)
    if not 1 <= depth <= 16:
        raise InputError(f"{told.path}: effective bits: expected 1 to 16, got {depth}.")
    count = told.whole("count")
    check_size(told.path, told.whole("width"), told.whole("height"), count)
    every = "" if skip == 1 else f", every {skip}th of {rate:g} Hz kept"
    stamps = (first + skip * np.arange(count)) / rate
    return Header(
        kind=f"Photron .mraw, {'packed ' if bits in (10, 12) else ''}{bits} bit",
        width_px=told.whole("width"),
        height_px=told.whole("height"),
        count=count,
        bit_depth=Stated(min(depth, bits), Origin.READ, f"{told.path.name}, effective bits"),
        rate_hz=Stated(rate / skip, Origin.READ, f"{told.path.name}, record rate{every}"),
        exposure_s=_exposure(told),
        stamps_s=Stated(stamps, Origin.READ, f"{told.path.name}, record rate and start frame, from the trigger's picture"),
        first=first,
        trigger=Stated(f"picture 0; the first one here is {first}", Origin.READ, f"{told.path.name}, start frame"),
    )


def _exposure(told: _Told) -> Stated[float] | None:
    """Nanoseconds where they are stated; the shutter of a ``.cihx`` is one over seconds, that of a ``.cih`` in seconds or ``1/n``."""
    where = f"{told.path.name}, shutter speed"
    if told.values.get("shutter_ns"):
        return Stated(read_positive(told.path, "shutter speed", 1e-9 * told.number("shutter_ns"), "s", LONGEST_S), Origin.READ, where)
    if not told.values.get("shutter"):
        return None
    value = told.number("shutter")
    inverse = told.path.suffix.lower() == ".cihx" and value > 0
    return Stated(read_positive(told.path, "shutter speed", 1.0 / value if inverse else value, "s", LONGEST_S), Origin.READ, where)


def _side_car(path: Path) -> str:
    try:
        size = path.stat().st_size
        if size > LARGEST_SIDE_CAR_BYTES:
            raise InputError(f"{path}: expected at most {LARGEST_SIDE_CAR_BYTES} bytes, got {size}.")
        return path.read_bytes().decode("utf-8", errors="replace")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None


def _cihx(path: Path) -> dict[str, str]:
    text = _side_car(path)
    begin, end = text.find("<cih>"), text.rfind("</cih>")
    if begin < 0 or end < begin:
        raise InputError(f"{path}: expected XML between <cih> and </cih>, got none.")
    if "<!" in text[begin:end]:
        raise InputError(f"{path}: expected XML without declarations, got some (<!).")
    try:
        root = ET.fromstring(text[begin : end + len("</cih>")])
        return {key: (root.findtext(place) or "").strip() for key, place in XML.items()}
    except (ET.ParseError, RecursionError, ValueError) as error:
        raise InputError(f"{path}: expected XML ({error}).") from None


def _cih(path: Path) -> dict[str, str]:
    pairs = (line.split(" : ", 1) for line in _side_car(path).splitlines() if " : " in line)
    told = {name.strip(): value.strip() for name, value in pairs}
    return {key: told[name] for key, name in LINES.items() if name in told}
