"""``tumble calibrate`` from pictures, whole: what it finds, what it writes, what it refuses."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from datasets.calibration_files import FILE, read_calibration, write_calibration
from datasets.camera_files import read_camera
from datasets.tiff_frames import FrameStackWriter
from datasets.video.images import read_image
from datasets.vocabulary.board import Board
from datasets.vocabulary.calibration import Calibration
from tests.calibrations import BOARD, LENS, placements, ring, write_pictures
from tumble.cli.main import main

COUNT = 9
WORDS = ("--board", BOARD.words, "-q")


@pytest.fixture(scope="module")
def boards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pictures of two cameras, taken at the same instants."""
    folder, rng = tmp_path_factory.mktemp("boards"), np.random.default_rng(4)
    poses = placements(COUNT, rng)
    for camera in ring(2, rng):
        write_pictures(folder / camera.name, camera, poses, rng)
    return folder


def test_a_camera_is_found_and_taken_by_import(boards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "camera"
    assert main(["calibrate", "camera", str(boards / "cam0"), "--board", BOARD.words, "--json", "--out", str(out)]) == 0
    assert json.loads(capsys.readouterr().out)["board"] == BOARD.words
    made = read_calibration(out)
    assert made.covariance is not None
    assert made.fit is not None
    assert made.fit.rms_px < 0.1
    sigma = np.sqrt(np.diag(made.covariance))
    found = made.cameras[0].intrinsics
    for k, name in enumerate(("fx_px", "fy_px", "cx_px", "cy_px")):
        assert abs(getattr(found, name) - getattr(LENS, name)) < 4 * sigma[k]
    for path in (out, out / FILE):
        assert read_camera(path).intrinsics == found
    page = (out / "calibration.html").read_text(encoding="utf-8")
    assert "focal length x" in page
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_a_rig_is_found_in_the_first_cameras_frame(boards: Path, tmp_path: Path) -> None:
    out = tmp_path / "rig"
    assert main(["calibrate", "rig", str(boards / "cam0"), str(boards / "cam1"), *WORDS, "--out", str(out)]) == 0
    made = read_calibration(out)
    assert [camera.name for camera in made.cameras] == ["cam0", "cam1"]
    np.testing.assert_array_equal(made.cameras[0].R_cam_world, np.eye(3))
    true = ring(2, np.random.default_rng(0))[1]
    angle = np.arccos(np.clip((np.trace(made.cameras[1].R_cam_world @ true.R_cam_world.T) - 1) / 2, -1, 1))
    assert np.rad2deg(angle) < 0.2
    assert read_camera(out, 1).name == "cam1"


def refused(words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What is said where nothing is written."""
    out = tmp_path / "out"
    assert main(["calibrate", *words, "--out", str(out)]) == 2
    assert not out.exists()
    return capsys.readouterr().err


def test_bad_pictures_are_refused_by_name(boards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = sorted((boards / "cam0").iterdir())
    some = [str(file) for file in files]
    rng = np.random.default_rng(9)
    empty = write_pictures(tmp_path / "empty", ring(1, rng)[0], [(np.eye(3), np.array([5.0, 5.0, 0.2]))], rng) / "00.png"
    said = refused(["camera", *some[:4], str(empty), *WORDS], tmp_path, capsys)
    assert f"{empty}: expected a picture of the board {BOARD.words}, got one without it" in said
    said = refused(["camera", *some[:2], *WORDS], tmp_path, capsys)
    assert some[0] in said
    assert "expected 3 pictures that show the board or more, got 2" in said
    twice = shutil.copy(files[1], tmp_path / "copy.png")
    said = refused(["camera", *some, str(twice), *WORDS], tmp_path, capsys)
    assert f"{twice}: expected pictures that differ, got the same as {some[1]}" in said
    said = refused(["camera", str(boards / "cam0"), "--board", "charuco:10x6:5mm:3.7mm:DICT_5X5_250", "-q"], tmp_path, capsys)
    assert "is --board right" in said
    assert str(boards / "cam0") in said
    said = refused(["camera", str(boards / "cam0"), "--board", "chessboard:9x7:5mm", "-q"], tmp_path, capsys)
    assert "got none that shows it; is --board right?" in said
    said = refused(["camera", str(tmp_path / "none.png"), *WORDS], tmp_path, capsys)
    assert "there is no such file" in said


def test_parallel_boards_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(3)
    folder = write_pictures(tmp_path / "flat", ring(1, rng)[0], placements(5, rng, tilt_rad=0.0), rng)
    said = refused(["camera", str(folder), *WORDS], tmp_path, capsys)
    assert "expected boards tilted against each other" in said
    assert str(folder) in said


def test_a_rig_that_shares_no_target_is_refused(boards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(9)
    away = [(np.eye(3), np.array([5.0, 5.0, 0.2]))]
    camera = ring(1, rng)[0]
    for name, first in (("one", True), ("two", False)):
        (tmp_path / name).mkdir()
        for k in range(8):
            source = boards / "cam0" / f"{k:02d}.png"
            if (k < 4) == first:
                shutil.copy(source, tmp_path / name)
            else:
                write_pictures(tmp_path / "blank", camera, away, rng)
                shutil.copy(tmp_path / "blank" / "00.png", tmp_path / name / f"{k:02d}.png")
    said = refused(["rig", str(tmp_path / "one"), str(tmp_path / "two"), *WORDS], tmp_path, capsys)
    assert "camera 2: expected pictures of the board taken at one instant with another camera" in said
    (tmp_path / "two" / "07.png").unlink()
    said = refused(["rig", str(tmp_path / "one"), str(tmp_path / "two"), *WORDS], tmp_path, capsys)
    assert f"{tmp_path / 'two'}: expected 8 pictures as {tmp_path / 'one'} has, got 7" in said


@pytest.mark.parametrize(
    ("board", "expected"),
    [
        ("charuco:12x9", "expected charuco:12x9:5mm"),
        ("charuco:12x9:5mm:6mm:DICT_5X5_250", "expected markers smaller than the squares"),
        ("charuco:12x9:5mm:3mm:DICT_9X9_1", "expected one of OpenCV's dictionaries"),
        ("charuco:12x12:5mm:3mm:DICT_5X5_50", "expected a dictionary of 72 markers or more, got 50"),
        ("chessboard:1x1:5mm", "expected 3 to 100 squares"),
    ],
)
def test_boards_that_are_none(board: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert expected in refused(["camera", "x.png", "--board", board], tmp_path, capsys)


def test_import_takes_a_camera_and_the_cameras_of_a_rig(boards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rig, gravity = tmp_path / "rig", tmp_path / "gravity"
    assert main(["calibrate", "rig", str(boards / "cam0"), str(boards / "cam1"), *WORDS, "--out", str(rig)]) == 0
    gravity.mkdir()
    down = np.array([0.0, 9.8, 0.3])
    write_calibration(Calibration(gravity_world=down, gravity_covariance=1e-4 * np.eye(3)), gravity / FILE)
    capsys.readouterr()
    words = ["--camera", str(rig), "--camera", str(rig), "--gravity", str(gravity), "--rate", "1000", "--exposure", "1ms"]
    assert main(["import", str(boards / "cam0"), str(boards / "cam1"), *words, "--dry-run", "--json", "--out", str(tmp_path / "run")]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    shown = {value["name"]: value for value in found["values"]}
    assert shown["gravity"]["value"] == down.tolist()
    assert shown["gravity"]["origin"] == "given"
    assert [missing["name"] for missing in found["missing"]] == ["particle"]
    assert main(["import", str(boards / "cam0"), "--camera", str(gravity), "--dry-run", "--out", str(tmp_path / "run")]) == 2
    assert f"{gravity}: expected a calibration with a camera, got one of gravity alone" in capsys.readouterr().err


def test_a_chessboard_in_a_stack_of_16_bit(tmp_path: Path) -> None:
    rng, board = np.random.default_rng(5), Board(8, 6, 5e-3)
    poses = placements(10, rng, tilt_rad=0.5, distance_m=0.17)
    folder = write_pictures(tmp_path / "pictures", ring(1, rng)[0], poses, rng, board)
    with FrameStackWriter(tmp_path / "stack.tif") as writer:
        for file in sorted(folder.iterdir()):
            writer.append(read_image(file).astype(np.uint16) * 13)
    out = tmp_path / "camera"
    assert main(["calibrate", "camera", str(tmp_path / "stack.tif"), "--board", board.words, "-q", "--out", str(out)]) == 0
    made = read_calibration(out)
    assert made.covariance is not None
    assert abs(made.cameras[0].intrinsics.fx_px - LENS.fx_px) < 4 * np.sqrt(made.covariance[0, 0])


def test_pictures_paired_wrongly_are_refused(boards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, first in (("one", 0), ("two", 1)):
        (tmp_path / name).mkdir()
        for k in range(7):
            shutil.copy(boards / f"cam{first}" / f"{k + first:02d}.png", tmp_path / name / f"{k}.png")
    said = refused(["rig", str(tmp_path / "one"), str(tmp_path / "two"), *WORDS], tmp_path, capsys)
    assert "are pictures paired rightly?" in said


def test_a_rig_of_others_is_read_and_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    K = np.array([[900.0, 0.0, 160.0], [0.0, 900.0, 120.0], [0.0, 0.0, 1.0]])
    np.save(tmp_path / "P.npy", np.stack([K @ np.column_stack([np.eye(3), [x, 0.0, 500.0]]) for x in (0.0, 100.0)]))
    words = ["rig", str(tmp_path / "P.npy"), "--unit", "mm"]
    assert "expected --size WIDTHxHEIGHT beside matrices" in refused(words, tmp_path, capsys)
    assert "expected --board BOARD with pictures, or files of others" in refused(["rig", str(tmp_path)], tmp_path, capsys)
    out = tmp_path / "rig"
    assert main(["calibrate", *words, "--size", "320x240", "--out", str(out)]) == 0
    assert "not stated" in capsys.readouterr().out
    np.testing.assert_allclose(read_calibration(out).cameras[1].t_cam_world, [0.1, 0.0, 0.0], atol=1e-12)


def test_a_camera_of_a_calibration_says_how_sure_it_is(boards: Path, tmp_path: Path) -> None:
    rig = tmp_path / "rig"
    assert main(["calibrate", "rig", str(boards / "cam0"), str(boards / "cam1"), *WORDS, "--out", str(rig)]) == 0
    made = read_calibration(rig)
    assert made.covariance is not None
    for number, first in ((0, 0), (1, 9)):
        spread = read_camera(rig, number).lens_covariance
        assert spread is not None
        np.testing.assert_array_equal(spread, made.covariance[first : first + 9, first : first + 9])
    assert all(camera.lens_covariance is None for camera in made.cameras)
