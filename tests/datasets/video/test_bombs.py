"""Small recordings that claim to be large: refused by name, at once and without memory."""

import struct
import time
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.video import open_video, phantom
from datasets.video.writing import Recorded, write_cine, write_mraw

PICTURES = [np.full((20, 24), 7, np.uint16)] * 3
HOW = Recorded(4000.0, 5e-5)
FEW_BYTES, SOON_S = 2**26, 5.0


def png(width: int, height: int) -> bytes:
    """A grey picture of zeros with a megabyte of data at most, unpacked."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    data = zlib.compress(bytes(min(height * (width + 1), 2**20)))
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
        + chunk(b"IDAT", data)
        + chunk(b"IEND", b"")
    )


def cine(at: int, layout: str, *values: int) -> Callable[[Path], Path]:
    """A ``.cine`` with values put in at a byte."""

    def write(folder: Path) -> Path:
        write_cine(folder / "bomb.cine", PICTURES, HOW, bits=16)
        data = bytearray((folder / "bomb.cine").read_bytes())
        struct.pack_into(layout, data, at, *values)
        (folder / "bomb.cine").write_bytes(data)
        return folder / "bomb.cine"

    return write


def mraw(old: str, new: str) -> Callable[[Path], Path]:
    """A ``.mraw`` whose ``.cih`` says something else."""

    def write(folder: Path) -> Path:
        write_mraw(folder / "bomb.mraw", PICTURES, HOW, bits=12)
        cih = folder / "bomb.cih"
        cih.write_text(cih.read_text().replace(old, new))
        return folder / "bomb.mraw"

    return write


def laughs(folder: Path) -> Path:
    """XML entities that become gigabytes."""
    lines = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 12))
    (folder / "bomb.mraw").write_bytes(b"")
    (folder / "bomb.cihx").write_text(f'<!DOCTYPE cih [<!ENTITY l0 "ha">{lines}]><cih><!-- --><a>&l11;</a></cih>')
    return folder / "bomb.mraw"


def pictures(width: int, height: int) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / "bomb").mkdir()
        (folder / "bomb" / "0.png").write_bytes(png(width, height))
        return folder / "bomb"

    return write


BOMBS = {
    "a .cine of 4 10^9 pixels": (cine(phantom.FILE_HEADER.size + 4, "<ii", 65_000, 65_000), "got 65000 x 65000"),
    "a .cine of 4 10^9 pictures": (cine(20, "<I", 2**32 - 1), "expected 1 to 1000000 pictures"),
    "a .cine whose table lies beyond its end": (cine(32, "<I", 2**31), "places of 3 pictures"),
    "a .cine whose setup lies beyond its end": (cine(28, "<I", 2**31), "the camera's setup"),
    "a .mraw of 10^6 pictures": (mraw("Total Frame : 3", "Total Frame : 1000000"), "it is cut off"),
    "a .mraw of 10^12 pixels": (mraw("Image Width : 24", "Image Width : 100000000000"), "expected pictures of 1 to 65536 px"),
    "entities in a .cihx": (laughs, "XML"),
    "a PNG of 4 10^8 pixels": (pictures(20_000, 20_000), "0.png: expected a picture"),
    "a PNG whose data end early": (pictures(9_000, 9_000), "0.png"),
}


@pytest.mark.parametrize("what", list(BOMBS))
def test_a_bomb_is_refused(what: str, tmp_path: Path) -> None:
    write, said = BOMBS[what]
    path = write(tmp_path)
    began = time.process_time()
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=said) as caught:
            open_video(path).read(0)
        limit = FEW_BYTES if "end early" not in what else 4 * FEW_BYTES  # the picture that is stated is allowed, and taken
        assert tracemalloc.get_traced_memory()[1] < limit
    finally:
        tracemalloc.stop()
    assert time.process_time() - began < SOON_S
    assert str(tmp_path) in str(caught.value)
