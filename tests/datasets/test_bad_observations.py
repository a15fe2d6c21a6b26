"""Everything that may be wrong with an observation on disk, each with the sentence a person reads."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile

from datasets.errors import InputError
from datasets.observation_files import read_observation, write_observation
from datasets.tiff_frames import write_stack


@pytest.fixture
def folder(outline_observation, tmp_path) -> Path:
    write_observation(outline_observation, tmp_path / "o")
    return tmp_path / "o"


@pytest.fixture
def frame_folder(frame_observation, tmp_path) -> Path:
    write_observation(frame_observation, tmp_path / "o")
    return tmp_path / "o"


def refused(folder: Path, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_observation(folder)


def edited(folder: Path, keys: list[Any], value: Any, *, keep_digest: bool = False) -> None:
    """Change one value of observation.json (``...`` deletes it), as a person would who deletes the sha256 line too."""
    path = folder / "observation.json"
    document = json.loads(path.read_text())
    place = document
    for key in keys[:-1]:
        place = place[key]
    if value is ...:
        del place[keys[-1]]
    else:
        place[keys[-1]] = value
    if not keep_digest:
        del document["sha256"]
    path.write_text(json.dumps(document))


def test_no_folder(tmp_path):
    refused(tmp_path / "none", "expected the folder of an observation, got nothing")
    (tmp_path / "file").write_text("")
    refused(tmp_path / "file", "got a file")
    refused(tmp_path, "observation.json: there is no such file")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_truncated_json(folder, share):
    path = folder / "observation.json"
    text = path.read_text()
    path.write_text(text[: int(share * len(text))])
    refused(folder, r"observation\.json: (expected JSON, got an empty file|line \d+, column \d+: the file ends too early)")


def test_json_that_is_not_json(folder):
    path = folder / "observation.json"
    path.write_text(path.read_text().replace(":", "=", 1))
    refused(folder, r"line 2, column \d+: not valid JSON")
    path.write_bytes(b"\x89PNG\xff\xfe")
    refused(folder, "expected JSON text in UTF-8, got binary data")
    path.write_text('{"a": NaN}')
    refused(folder, r"at \$\.a: expected a finite number, got NaN")


def test_foreign_json(folder):
    path = folder / "observation.json"
    path.write_text('{"frames": []}')
    refused(folder, 'expected "format": "tumble observation", got JSON without "format"')
    path.write_text('{"format": "tumble estimate"}')
    refused(folder, 'got "format": "tumble estimate"')
    path.write_text("[1, 2]")
    refused(folder, "this is another kind of file")


def test_newer_schema(folder):
    edited(folder, ["schema_version"], 2)
    refused(folder, "expected schema version 1 or older, got 2; a newer Tumble wrote it")


def test_edited_by_hand(folder):
    edited(folder, ["gravity_world", 1], 9.7, keep_digest=True)
    refused(folder, 'was edited after being written .* delete the "sha256" line to accept it')


def test_deleting_the_digest_line_accepts_an_edit(folder):
    path = folder / "observation.json"
    text = path.read_text().replace("9.80665", "9.7")
    path.write_text("\n".join(line for line in text.splitlines() if '"sha256"' not in line))
    assert read_observation(folder).gravity_world[1] == 9.7


def test_another_layout_is_no_edit(folder):
    path = folder / "observation.json"
    path.write_text(json.dumps(json.loads(path.read_text()), indent=8))
    assert read_observation(folder).name == "seq_0000"


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (["clock"], ..., r'at \$: expected the key "clock", which is missing'),
        (
            ["cameras", 0, "intrinsics", "fx_px"],
            "six hundred",
            r'at \$\.cameras\[0\]\.intrinsics\.fx_px: expected number, got "six hundred"',
        ),
        (["cameras", 0, "intrinsics", "fx_px"], -1, r"fx_px: expected a number > 0, got -1"),
        (["cameras", 0, "intrinsics", "width"], 3, r'got "width" \(did you mean "width_px"\?\)'),
        (["cameras", 0, "t_cam_world"], [0, 0], r"t_cam_world: expected at least 3 entries, got 2"),
        (["cameras", 0, "recording", "kind"], "film", r'expected "frames" or "outlines", got "film"'),
        (["cameras", 0, "recording", "file"], "../x.npz", r"recording\.file: expected"),
        (["cameras"], {}, r"at \$\.cameras: expected a list, got \{\}"),
        (["name"], "a/b", r"at \$\.name: expected text of the form"),
        (["name"], "..", r"at \$\.name: expected text of the form"),
        (["cameras", 0, "recording", "file"], "gone.npz", r"gone\.npz: there is no such file"),
        (["mass_kg"], 3000.0, r"expected kilograms below 1000, got 3000; is it in grams"),
        (["gravity_world"], [0, 9806.65, 0], r"gravity_world: expected m/s2 .* got 9806\.65; it looks like millimetres"),
        (["clock", "times_s"], [0, 1, 2, 2, 3], r"\$\.clock\.times_s\[3\]: expected times that rise, got 2\.0 after 2\.0"),
        (["clock", "exposure_s"], 50.0, r"expected seconds, got 50; it looks like microseconds"),
        (["clock", "exposure_s"], 0.3, r"expected at most the time between two frames \(0\.00025 s\), got 0\.3 s"),
        (["clock", "times_s"], [0, 1, 2, 3], r"outlines_hsv\.npz: expected 4 outlines, one per recorded entry, got 5"),
        (["views", "cameras", 1, "t_cam_particle"], [0, 0, 1200.0], r"got a distance of 1200; it looks like millimetres taken for metres"),
        (["views", "cameras", 1, "t_cam_particle"], [0, 0, -1.2], r"expected the particle in front of the camera"),
        (["views", "cameras", 0, "R_cam_particle", 0], [1, 0.1, 0], r"\$\.views\.cameras\[0\]\.R_cam_particle: expected a rotation"),
        (["cameras", 0, "R_cam_world", 0], [-1, 0, 0], r"got a mirrored one \(determinant -1\)"),
        (["views", "cameras", 0, "intrinsics", "cx_px"], 31500.0, r"expected a principal point near the 64 x 48 px picture"),
        (["cameras", 0, "intrinsics", "pixel_pitch_m"], 20.0, r"expected metres \(20e-6 is usual\), got 20"),
        (
            ["cameras", 0, "intrinsics", "distortion"],
            [-40000.0, 0, 0, 0, 0],
            r"cameras\[0\]\.intrinsics\.distortion: expected a distortion that can be undone all over the 64 x 48 px picture",
        ),
        (["cameras", 0, "intrinsics", "width_px"], 4, r'camera "hsv": outline 0: expected pixels of a 4 x 48 picture'),
    ],
)
def test_hand_edited_values(folder, keys, value, message):
    edited(folder, keys, value)
    refused(folder, message)


def test_writing_what_cannot_be_true_is_refused_too(outline_observation, tmp_path):
    wrong = replace(outline_observation, gravity_world=np.array([0.0, 9806.65, 0.0]))
    with pytest.raises(InputError, match="looks like millimetres"):
        write_observation(wrong, tmp_path / "o")
    assert not (tmp_path / "o" / "observation.json").exists()


def test_missing_frames(frame_folder, frame_observation):
    pictures = [frame_observation.recordings[0].read(k) for k in range(3)]
    write_stack(frame_folder / "frames_hsv.tif", pictures)
    refused(frame_folder, r'frames_hsv\.tif: expected 5 frames \(camera "hsv"\), got 3; frame 3 and later are missing')


@pytest.mark.parametrize("size", [0, 4, 100, 8000, 20_000, 30_000])
def test_truncated_frames(frame_folder, size):
    path = frame_folder / "frames_hsv.tif"
    path.write_bytes(path.read_bytes()[:size])
    refused(frame_folder, r"frames_hsv\.tif: (frame \d is cut off|expected a TIFF stack, got a file that is cut off|expected 5 frames)")


def test_foreign_frames(frame_folder):
    (frame_folder / "frames_hsv.tif").write_text("this is no picture")
    refused(frame_folder, r"frames_hsv\.tif: expected a TIFF stack, got a file that is cut off or of another kind")


def test_frames_of_another_size(frame_folder):
    write_stack(frame_folder / "frames_hsv.tif", [np.zeros((64, 48), np.uint16)] * 5)
    refused(frame_folder, re.escape('frame 0: expected 64 x 48 px (width x height; camera "hsv"), got 48 x 64'))


def test_one_frame_of_another_size(frame_folder):
    write_stack(frame_folder / "frames_hsv.tif", [np.zeros((48, 64 + (k == 3)), np.uint16) for k in range(5)])
    refused(frame_folder, "frame 3: expected 64 x 48 px")


def test_a_view_whose_camera_has_another_size(frame_folder):
    edited(frame_folder, ["views", "cameras", 1, "intrinsics", "width_px"], 48)
    refused(frame_folder, r"calibrated views: expected cameras of one picture size.* 64 x 48 px for entry 0 and 48 x 48 for entry 1")


@pytest.mark.parametrize(("photometric", "named"), [("miniswhite", "MINISWHITE"), ("palette", "PALETTE")])
def test_frames_whose_numbers_are_no_light(frame_folder, photometric, named):
    settings = {"colormap": np.zeros((3, 256), np.uint16)} if photometric == "palette" else {}
    tifffile.imwrite(frame_folder / "frames_hsv.tif", np.zeros((5, 48, 64), np.uint8), photometric=photometric, **settings)
    refused(frame_folder, rf"frames_hsv\.tif: frame 0: expected grey pictures in which 0 is black \(MINISBLACK\), got {named}")


def test_background_of_another_size(frame_folder):
    write_stack(frame_folder / "background_hsv.tif", [np.zeros((48, 48), np.uint16)])
    refused(frame_folder, "background_hsv.tif: frame 0: expected 64 x 48 px")


def test_too_few_backgrounds(frame_folder):
    write_stack(frame_folder / "views_background.tif", [np.zeros((48, 64), np.uint16)])
    refused(frame_folder, "views_background.tif: expected at least 2 pages, got 1")


def test_coloured_frames(frame_folder):
    tifffile.imwrite(frame_folder / "frames_hsv.tif", np.zeros((5, 48, 64, 3), np.uint8), photometric="rgb")
    refused(frame_folder, "frame 0: expected grey pictures of 16")


def test_values_beyond_the_bit_depth(frame_folder):
    write_stack(frame_folder / "frames_hsv.tif", [np.full((48, 64), 16 * k * 800, np.uint16) for k in range(5)])
    frames = read_observation(frame_folder).recordings[0]
    assert frames.read(0).max() == 0
    with pytest.raises(InputError, match=r"frame 1: expected values of 12 bit \(at most 4095\), got 12800; .* left-aligned"):
        frames.read(1)
