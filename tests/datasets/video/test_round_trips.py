"""A small recording written as cameras write it and read back: the same pixels, the same times, and where each value is from."""

import struct
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image

from datasets.errors import InputError
from datasets.video import Moment, Origin, open_video
from datasets.video.phantom_table import LINEAR_DN
from datasets.video.writing import Recorded, write_cine, write_film, write_mraw

HOW = Recorded(rate_hz=30_000.0, exposure_s=2e-5, depth=12, first=-7)
TIMES = (-7 + np.arange(4)) / 30_000.0
Pictures = list[NDArray[np.uint16]]


def recorded(bits: int, *, width: int = 30, height: int = 22) -> Pictures:
    """Four pictures without any symmetry; for packed 10 bit with values that the camera's curve has."""
    values = np.random.default_rng(bits).integers(0, 1 << min(bits, 12), (4, height, width)).astype(np.uint16)
    return list(LINEAR_DN[values] if bits == 10 else values)


def cine(bits: int) -> Callable[[Path], tuple[Path, Pictures]]:
    def write(folder: Path) -> tuple[Path, Pictures]:
        pictures = recorded(bits)
        write_cine(folder / "drop.cine", pictures, HOW, bits=bits)
        return folder / "drop.cine", pictures

    return write


def mraw(bits: int, name: str) -> Callable[[Path], tuple[Path, Pictures]]:
    def write(folder: Path) -> tuple[Path, Pictures]:
        pictures = recorded(bits)
        write_mraw(folder / "drop.mraw", pictures, HOW, bits=bits)
        return folder / name, pictures

    return write


def tiff(**settings: object) -> Callable[[Path], tuple[Path, Pictures]]:
    def write(folder: Path) -> tuple[Path, Pictures]:
        pictures = recorded(12)
        tifffile.imwrite(folder / "drop.tif", np.stack(pictures), photometric="minisblack", **settings)
        return folder / "drop.tif", pictures

    return write


def film(bits: int) -> Callable[[Path], tuple[Path, Pictures]]:
    def write(folder: Path) -> tuple[Path, Pictures]:
        pictures = recorded(bits, width=32)
        write_film(folder / "drop.avi", pictures, HOW.rate_hz, bits=bits)
        return folder / "drop.avi", pictures

    return write


def images(suffix: str, bits: int) -> Callable[[Path], tuple[Path, Pictures]]:
    def write(folder: Path) -> tuple[Path, Pictures]:
        pictures = recorded(bits)
        for k, picture in enumerate(pictures):
            stored = picture.astype(np.uint16 if bits > 8 else np.uint8)
            if suffix == ".pgm" and bits > 8:
                head = f"P5\n# by a camera\n{picture.shape[1]} {picture.shape[0]}\n4095\n".encode()
                (folder / f"frame {8 + k}.pgm").write_bytes(head + picture.astype(">u2").tobytes())
            elif suffix == ".tif":
                tifffile.imwrite(folder / f"frame {8 + k}.tif", stored, photometric="minisblack")
            else:
                Image.fromarray(stored).save(folder / f"frame {8 + k}{suffix}")
        (folder / "notes.txt").write_text("not a picture")
        return folder, pictures

    return write


FORMS = {
    **{f"cine {bits}": cine(bits) for bits in (8, 10, 12, 16)},
    **{f"mraw {bits}": mraw(bits, "drop.mraw") for bits in (8, 12, 16)},
    "mraw by its cih": mraw(12, "drop.cih"),
    "TIFF": tiff(),
    **{f"TIFF {name}": tiff(compression=name) for name in ("zlib", "lzw", "zstd", "packbits")},
    "TIFF differences": tiff(compression="lzw", predictor=True, rowsperstrip=5),
    "FFV1 8": film(8),
    "FFV1 16": film(16),
    "PNG 8": images(".png", 8),
    "PNG 16": images(".png", 16),
    "PGM": images(".pgm", 8),
    "PGM 12": images(".pgm", 12),
    "BMP": images(".bmp", 8),
    "TIFF files": images(".tif", 16),
}


@pytest.mark.parametrize("form", list(FORMS))
def test_pixels_come_back(form: str, tmp_path: Path) -> None:
    path, pictures = FORMS[form](tmp_path)
    video = open_video(path)
    assert video.header.count == 4
    for k in (0, 1, 2, 3, 1):
        np.testing.assert_array_equal(video.read(k), pictures[k])
        assert video.read(k).dtype == np.uint16


@pytest.mark.parametrize("form", [form for form in FORMS if form.startswith(("cine", "mraw"))])
def test_a_cameras_file_says_how_it_was_recorded(form: str, tmp_path: Path) -> None:
    header = open_video(FORMS[form](tmp_path)[0]).header
    stored = next(int(word) for word in [*form.split(), "12"] if word.isdigit())
    assert header.bit_depth.value == {8: 8}.get(stored, 12)
    assert header.rate_hz is not None
    assert header.exposure_s is not None
    assert header.stamps_s is not None
    assert {header.bit_depth.origin, header.rate_hz.origin, header.exposure_s.origin, header.stamps_s.origin} == {Origin.READ}
    assert header.rate_hz.value == HOW.rate_hz
    np.testing.assert_allclose(header.exposure_s.value, HOW.exposure_s, rtol=0, atol=2.0**-32)
    resolution = 2.0**-31 if form.startswith("cine") else 0.0  # a .cine counts time in 2^-30 s
    np.testing.assert_allclose(header.stamps_s.value, TIMES, rtol=0, atol=resolution)
    assert header.stamped.value is (Moment.START if form.startswith("cine") else Moment.MIDDLE)
    assert header.stamped.origin is Origin.ASSUMED
    assert "-7" in str(header.trigger)


@pytest.mark.parametrize("form", ["TIFF", "PNG 16", "FFV1 16"])
def test_a_file_that_does_not_know_says_so(form: str, tmp_path: Path) -> None:
    header = open_video(FORMS[form](tmp_path)[0]).header
    assert header.exposure_s is None
    assert header.rate_hz is None
    assert (header.playback_hz is not None) == form.startswith("FFV1")
    assert header.bit_depth.value == 16
    assert header.bit_depth.origin is Origin.ASSUMED


def test_a_camera_that_kept_every_third_picture(tmp_path: Path) -> None:
    write_mraw(tmp_path / "a.mraw", recorded(8), HOW, bits=8)
    cih = tmp_path / "a.cih"
    cih.write_text(cih.read_text() + "Skip Frame : 3\n")
    header = open_video(cih).header
    assert header.rate_hz is not None
    assert header.stamps_s is not None
    assert header.rate_hz.value == 10_000.0
    np.testing.assert_array_equal(header.stamps_s.value, (-7 + 3 * np.arange(4)) / 30_000.0)


@pytest.mark.parametrize("shutter", ["2e-05", "1/50000", "1/50000 sec", "0.00002s"])
def test_a_shutter_as_cameras_write_it(shutter: str, tmp_path: Path) -> None:
    write_mraw(tmp_path / "a.mraw", recorded(8), HOW, bits=8)
    cih = tmp_path / "a.cih"
    cih.write_text(cih.read_text().replace("Shutter Speed(s) : 2e-05", f"Shutter Speed(s) : {shutter}"))
    exposure = open_video(cih).header.exposure_s
    assert exposure is not None
    assert exposure.value == pytest.approx(2e-5, rel=1e-12)


def test_an_old_phantom_file_and_one_that_lies_top_down(tmp_path: Path) -> None:
    path, pictures = cine(16)(tmp_path)
    data = bytearray(path.read_bytes())
    at = struct.unpack_from("<I", data, 32)[0]
    places = struct.unpack_from("<4Q", data, at)
    struct.pack_into("<4I", data, at, *places)  # version 0 has places of four bytes
    data[6] = 0
    struct.pack_into("<i", data, 44 + 8, -22)
    path.write_bytes(data)
    np.testing.assert_array_equal(open_video(path).read(2), pictures[2][::-1])


def test_a_tiff_in_jpeg_says_that_it_lost_something(tmp_path: Path) -> None:
    smooth = [cv2.GaussianBlur(picture, (0, 0), 5) for picture in recorded(8, width=64, height=40)]
    tifffile.imwrite(tmp_path / "a.tif", np.stack(smooth).astype(np.uint8), compression="jpeg", photometric="minisblack", rowsperstrip=16)
    video = open_video(tmp_path / "a.tif")
    assert "JPEG" in video.header.lossy
    assert np.abs(video.read(3).astype(int) - smooth[3]).max() < 8


def test_values_at_the_high_end_are_shifted_down(tmp_path: Path) -> None:
    pictures = recorded(12)
    write_mraw(tmp_path / "a.mraw", [picture << 4 for picture in pictures], HOW, bits=16)
    cih = tmp_path / "a.cih"
    cih.write_text(cih.read_text().replace("Side : Lower", "Side : Higher"))
    np.testing.assert_array_equal(open_video(cih).read(2), pictures[2])


def test_a_lossy_film_says_what_it_costs(tmp_path: Path) -> None:
    pictures = recorded(8, width=32)
    write_film(tmp_path / "a.avi", [cv2.GaussianBlur(picture, (0, 0), 4) for picture in pictures], 30.0, bits=8, codec="MJPG")
    header = open_video(tmp_path / "a.avi").header
    assert "MJPG" in header.lossy
    assert header.bit_depth.value == 8


def read_whole(path: Path) -> None:
    video = open_video(path)
    for k in range(4):
        video.read(k)


@pytest.mark.parametrize("cut", [400, 2000])
@pytest.mark.parametrize("form", ["cine 16", "mraw 12", "TIFF", "FFV1 8"])
def test_what_is_cut_off_is_refused_by_name(form: str, cut: int, tmp_path: Path) -> None:
    path, _ = FORMS[form](tmp_path)
    path.write_bytes(path.read_bytes()[:-cut])
    with pytest.raises(InputError, match=path.name):
        read_whole(path)


def test_colours_and_jpeg_of_a_phantom_are_refused(tmp_path: Path) -> None:
    path, _ = cine(16)(tmp_path)
    data = bytearray(path.read_bytes())
    data[4] = 1
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"drop.cine: expected uncompressed grey pictures, got JPEG"):
        open_video(path)
    data[4], data[84 + 808] = 0, 3
    path.write_bytes(data)
    with pytest.raises(InputError, match="colour camera's mosaic"):
        open_video(path)


def test_a_gap_in_the_numbers_of_pictures_is_said(tmp_path: Path) -> None:
    path, _ = images(".png", 8)(tmp_path)
    assert open_video(path).header.remark == ""
    (path / "frame 9.png").unlink()
    assert "jump from frame 8.png to frame 10.png" in open_video(path).header.remark


def test_pictures_that_would_lose_something_are_refused(tmp_path: Path) -> None:
    (tmp_path / "colours").mkdir()
    cv2.imwrite(str(tmp_path / "colours" / "0.png"), np.full((8, 8, 3), 40_000, np.uint16))
    (tmp_path / "stacks").mkdir()
    tifffile.imwrite(tmp_path / "stacks" / "0.tif", np.stack(recorded(12)), photometric="minisblack")
    for name, expected in (("colours", "got colours of 16 bit"), ("stacks", "got a stack of 4")):
        with pytest.raises(InputError, match=expected):
            read_whole(tmp_path / name)


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("x")
    (tmp_path / "lonely.mraw").write_bytes(b"x")
    (tmp_path / "empty").mkdir()
    for name, expected in (("a.txt", "a recording"), ("lonely.mraw", r"lonely.cihx or lonely.cih"), ("empty", "pictures of one kind")):
        with pytest.raises(InputError, match=expected):
            open_video(tmp_path / name)
    with pytest.raises(InputError, match="no such file"):
        open_video(tmp_path / "none.cine")
