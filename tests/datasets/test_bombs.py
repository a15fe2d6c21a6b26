"""Files that are small and would become large, or never end: refused with the file's name, at once and without memory."""

import struct
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import tifffile
from numpy.lib import format as npy

from datasets import array_files
from datasets.array_files import read_arrays
from datasets.errors import InputError
from datasets.mesh_files import read_mesh
from datasets.outline_files import read_outlines
from datasets.tiff_frames import TiffFrames
from tests.hostile.valid_files import pack_bits, tiff

DEFLATE, PACKBITS, NONE, LZW, JPEG, ZSTD, LZMA = 8, 32773, 1, 5, 7, 50000, 34925
PLAIN = np.arange(48 * 64, dtype="<u2").reshape(48, 64)
FEW_BYTES = 2**26
LARGE_JPEG = imagecodecs.jpeg8_encode(np.zeros((8000, 8000), np.uint8))


def refused(read: Callable[[], object], path: Path, message: str) -> None:
    """Refused by name, and with little memory."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=message) as caught:
            read()
        assert tracemalloc.get_traced_memory()[1] < FEW_BYTES
    finally:
        tracemalloc.stop()
    assert str(caught.value).startswith(str(path))


def zeros(count: int) -> bytes:
    """Deflate data that become ``count`` bytes."""
    packer, block = zlib.compressobj(9), bytes(2**20)
    return b"".join(packer.compress(block) for _ in range(count // len(block))) + packer.flush()


TIFFS: dict[str, tuple[Callable[[], bytes], str]] = {
    "deflate data of 128 MB": (lambda: tiff([zeros(2**27)], 64, 48, DEFLATE), "frame 0 cannot be read .*expected 6144 bytes.*got more"),
    "PackBits data of 64 MB": (lambda: tiff([b"\x81\0" * 2**19], 64, 48, PACKBITS), "frame 0 cannot be .*expected 6144 bytes.*got more"),
    "damaged deflate data": (lambda: tiff([b"\x78\x9c" + b"\xff" * 200], 64, 48, DEFLATE), "frame 0 cannot be read .*deflate"),
    "deflate data that end early": (lambda: tiff([zlib.compress(bytes(6000))], 64, 48, DEFLATE), "expected 6144 bytes.*got 6000"),
    "a picture of 10^10 pixels": (lambda: tiff([zeros(2**20)], 100_000, 100_000, DEFLATE), "expected 1 to 65536 px along each side"),
    "a picture of 4 10^9 pixels": (lambda: tiff([zeros(2**20)], 65_000, 65_000, DEFLATE), "at most 1e[+]08 px, got 65000 x 65000"),
    "a picture of no pixels": (lambda: tiff([b"ab"], 0, 48, NONE), "frame 0"),
    "too few bytes for the pixels": (lambda: tiff([zeros(2**16)], 8000, 8000, DEFLATE), "expected at least 124032 bytes in a strip"),
    "a page that links to itself": (lambda: tiff([PLAIN.tobytes()], 64, 48, NONE, loop=0), "frame 1: expected another page"),
    "pages in a ring": (lambda: tiff([PLAIN.tobytes()] * 3, 64, 48, NONE, loop=1), "frame 3: expected another page"),
    "LZW data of 16 MB": (lambda: tiff([imagecodecs.lzw_encode(bytes(2**24))], 64, 48, LZW), "expected 6144 bytes.*got more"),
    "Zstandard data of 128 MB": (lambda: tiff([imagecodecs.zstd_encode(bytes(2**27))], 64, 48, ZSTD), "frame 0 cannot be .*Zstandard data"),
    "a JPEG of another size": (lambda: tiff([LARGE_JPEG], 64, 48, JPEG, bits=8), "frame 0 cannot be read .*of another size"),
    "JPEG of 16 bit": (lambda: tiff([LARGE_JPEG], 64, 48, JPEG), "expected pictures with no compression.*got compression JPEG"),
    "damaged LZW data": (lambda: tiff([b"\xff" * 200], 64, 48, LZW), "frame 0 cannot be read .*"),
    "compression that is not read": (lambda: tiff([b"abc"], 64, 48, LZMA), "expected pictures with no compression.*got compression LZMA"),
    "text": (lambda: b"no picture at all", "expected a TIFF stack"),
}


@pytest.mark.parametrize("name", TIFFS)
def test_pictures(tmp_path: Path, name: str) -> None:
    path, (make, message) = tmp_path / "frames.tif", TIFFS[name]
    path.write_bytes(make())
    refused(lambda: TiffFrames(path, 16).read(0), path, message)


@pytest.mark.parametrize(("tag", "value", "message"), [(322, 0, "frame 0"), (323, 65_520, "expected 4 strips or tiles, got 12 places")])
def test_tiles(tmp_path: Path, tag: int, value: int, message: str) -> None:
    path = tmp_path / "frames.tif"
    tifffile.imwrite(path, PLAIN, tile=(16, 16), photometric="minisblack", metadata=None)
    with tifffile.TiffFile(path) as stack:
        at = stack.pages[0].tags[tag].valueoffset
        size = struct.calcsize(stack.pages[0].tags[tag].dataformat)
    data = bytearray(path.read_bytes())
    data[at : at + size] = value.to_bytes(size, "little")
    path.write_bytes(data)
    refused(lambda: TiffFrames(path, 16).read(0), path, message)


def test_packed_bits_are_read(tmp_path: Path) -> None:
    (tmp_path / "f.tif").write_bytes(tiff([pack_bits(PLAIN.tobytes()), pack_bits(bytes(6144))], 64, 48, PACKBITS))
    frames = TiffFrames(tmp_path / "f.tif", 12)
    assert np.array_equal(frames.read(0), PLAIN)
    assert not frames.read(1).any()


def archive(path: Path, header: dict[str, object], held: int) -> None:
    """An archive whose only array states ``header`` and holds ``held`` zeros, packed."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed, packed.open("points_px.npy", "w") as member:
        npy.write_array_header_1_0(member, header)  # type: ignore[arg-type]
        for _ in range(held // 2**20):
            member.write(bytes(2**20))
        member.write(bytes(held % 2**20))


@pytest.mark.parametrize(
    ("descr", "shape", "held", "message"),
    [
        ("<f8", (2**20, 2), 2**24, "expected an array of at most 1048576 bytes, got 16777344"),
        ("<f8", (10**12, 2), 64, "expected 16000000000000 bytes for float64 of shape"),
        ("<f8", (3, 2), 64, "expected 48 bytes for float64 of shape .3, 2., got 64"),
        ("|O", (3, 2), 48, "expected numbers, got object"),
    ],
)
def test_arrays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, descr: str, shape: tuple[int, ...], held: int, message: str) -> None:
    monkeypatch.setattr(array_files, "LARGEST_ARRAY_BYTES", 2**20)
    path = tmp_path / "outlines_hsv.npz"
    archive(path, {"descr": descr, "fortran_order": False, "shape": shape}, held)
    refused(lambda: read_arrays(path, ("points_px",)), path, message)


def test_many_outlines_are_counted_before_they_are_made(tmp_path: Path) -> None:
    path = tmp_path / "outlines_hsv.npz"
    np.savez_compressed(path, points_px=np.zeros((0, 2)), offsets=np.zeros(10**6 + 1, dtype=np.int64))
    refused(lambda: read_outlines(path, 5), path, "expected 5 outlines, one per recorded entry, got 1000000")


def test_a_mesh_of_more_vertices_than_bytes(tmp_path: Path) -> None:
    path = tmp_path / "mesh.ply"
    path.write_text("ply\nformat ascii 1.0\nelement vertex 1000000000000\nproperty double x\nend_header\n0\n")
    refused(lambda: read_mesh(path), path, "expected at most 81 vertices and faces in 81 bytes")
