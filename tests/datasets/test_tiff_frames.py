import errno
import tracemalloc

import numpy as np
import pytest
import tifffile

from datasets.errors import InputError, TumbleError
from datasets.tiff_frames import FrameStackWriter, TiffFrames

RAMP = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64)


def test_a_stack_appears_only_when_closed(tmp_path):
    path = tmp_path / "a" / "frames.tif"
    with FrameStackWriter(path) as writer:
        writer.append(RAMP)
        assert not path.exists()
    assert np.array_equal(TiffFrames(path, 12).read(0), RAMP)
    assert [entry.name for entry in path.parent.iterdir()] == ["frames.tif"]


def abandon(path) -> None:
    with FrameStackWriter(path) as writer:
        writer.append(RAMP)
        raise KeyboardInterrupt


def test_leaving_by_an_exception_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        abandon(tmp_path / "frames.tif")
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_said_and_leaves_nothing(tmp_path, monkeypatch):
    writer = FrameStackWriter(tmp_path / "frames.tif")
    writer.append(RAMP)

    def full(*_args, **_settings):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(writer._writer, "write", full)
    with pytest.raises(TumbleError, match=r"frames\.tif: the disk is full; nothing was left half written\. Free some space"):
        writer.append(RAMP)
    assert list(tmp_path.iterdir()) == []


def test_wrong_pictures_are_a_programming_mistake(tmp_path):
    writer = FrameStackWriter(tmp_path / "frames.tif")
    with pytest.raises(TypeError, match="uint16"):
        writer.append(RAMP.astype(np.float64))
    writer.discard()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "settings",
    [
        *({"compression": "zlib"}, {"byteorder": ">"}, {"bigtiff": True}, {"tile": (16, 16)}, {"rowsperstrip": 7}),
        *({"compression": "lzw"}, {"compression": "lzw", "predictor": True, "rowsperstrip": 7}, {"compression": "zstd", "byteorder": ">"}),
    ],
    ids=["compressed", "big endian", "BigTIFF", "tiled", "strips", "LZW", "LZW differences", "Zstandard"],
)
def test_other_programs_stacks_are_read(tmp_path, settings):
    stack = np.stack([RAMP, RAMP[::-1], RAMP.T.reshape(48, 64)])
    outer = {key: settings[key] for key in ("byteorder", "bigtiff") if key in settings}
    inner = {key: value for key, value in settings.items() if key not in outer}
    tifffile.imwrite(tmp_path / "x.tif", stack, photometric="minisblack", **outer, **inner)
    frames = TiffFrames(tmp_path / "x.tif", 12)
    assert len(frames) == 3
    assert frames.shape == (48, 64)
    for k in range(3):
        assert np.array_equal(frames.read(k), stack[k])
        assert frames.read(k).dtype == np.uint16


def test_eight_bit_stacks_are_read(tmp_path):
    picture = (RAMP % 256).astype(np.uint8)
    tifffile.imwrite(tmp_path / "x.tif", picture, photometric="minisblack")
    assert np.array_equal(TiffFrames(tmp_path / "x.tif", 8).read(0), picture)


def test_background_pages(tmp_path):
    for name, values in (("f.tif", (1, 2, 3)), ("b.tif", (10, 20))):
        with FrameStackWriter(tmp_path / name) as writer:
            for value in values:
                writer.append(np.full((4, 4), value, np.uint16))
    plain = TiffFrames(tmp_path / "f.tif", 12)
    shared = TiffFrames(tmp_path / "f.tif", 12, tmp_path / "b.tif")
    mapped = TiffFrames(tmp_path / "f.tif", 12, tmp_path / "b.tif", (1, 0, 1))
    assert plain.background() is None
    assert plain.background_of(2) is None
    assert [int(shared.background_of(k)[0, 0]) for k in range(3)] == [10, 10, 10]
    assert [int(mapped.background_of(k)[0, 0]) for k in range(3)] == [20, 10, 20]


def test_memory_does_not_grow_with_the_recording(tmp_path):
    with FrameStackWriter(tmp_path / "f.tif") as writer:
        for k in range(200):
            writer.append(np.full((256, 256), k, np.uint16))
    frames = TiffFrames(tmp_path / "f.tif", 12)
    assert len(frames) == 200
    tracemalloc.start()
    for k in range(200):
        assert frames.read(k)[0, 0] == k
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5 * 256 * 256 * 2


def test_beyond_the_end(tmp_path):
    with FrameStackWriter(tmp_path / "f.tif") as writer:
        writer.append(RAMP)
    frames = TiffFrames(tmp_path / "f.tif", 12)
    with pytest.raises(IndexError):
        frames.read(1)


def test_a_stack_cut_after_it_was_opened(tmp_path):
    path = tmp_path / "f.tif"
    with FrameStackWriter(path) as writer:
        writer.append(RAMP)
    frames = TiffFrames(path, 12)
    assert len(frames) == 1
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(InputError, match="frame 0 cannot be read"):
        frames.read(0)
