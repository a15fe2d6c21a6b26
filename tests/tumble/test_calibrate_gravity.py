"""``tumble calibrate gravity``: the direction from threads, how sure it is, and what is refused."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from datasets.calibration_files import FILE, read_calibration, write_calibration
from datasets.camera_files import read_gravity
from datasets.vocabulary.calibration import Calibration
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from tumble.cli.main import main

LENS = Intrinsics(320, 240, 900.0, 905.0, 163.0, 117.0, (-0.15, 0.1, 5e-4, -4e-4, 0.0))
DOWN = np.array([0.08, 0.99, 0.06]) / np.linalg.norm([0.08, 0.99, 0.06])
CAMERAS = (
    HsvCamera("a", LENS, np.eye(3), np.zeros(3)),
    HsvCamera("b", LENS, Rotation.from_rotvec([0.0, 1.2, 0.0]).as_matrix(), np.array([-0.4, 0.0, 0.3])),
)


def along_thread(camera: HsvCamera, place: tuple[float, float, float]) -> np.ndarray:
    """Points (n, 2) px of a plumb line through ``place`` that the picture shows."""
    points = np.array(place) + np.linspace(-0.2, 0.2, 4001)[:, None] * DOWN
    px = camera.intrinsics.project(points @ camera.R_cam_world.T + camera.t_cam_world)
    return px[((px >= 0) & (px <= [camera.intrinsics.width_px - 1, camera.intrinsics.height_px - 1])).all(axis=1)]


def picture(path: Path, points: np.ndarray, rng: np.random.Generator) -> Path:
    """A dark thread, drawn four times as fine."""
    fine = np.full((4 * LENS.height_px, 4 * LENS.width_px), 180.0)
    cv2.polylines(fine, [np.rint((points + 0.5) * 4 - 0.5).astype(np.int32)[:, None]], False, 60.0, 9)
    grey = fine.reshape(LENS.height_px, 4, LENS.width_px, 4).mean(axis=(1, 3)) + rng.normal(0, 2, (LENS.height_px, LENS.width_px))
    Image.fromarray(np.clip(np.rint(grey), 0, 255).astype(np.uint8)).save(path)
    return path


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    (tmp_path / "rig").mkdir()
    write_calibration(Calibration(cameras=CAMERAS), tmp_path / "rig" / FILE)
    return tmp_path / "rig"


def angle_deg(vector: np.ndarray) -> float:
    return float(np.rad2deg(np.arccos(np.clip(vector @ DOWN / np.linalg.norm(vector), -1, 1))))


def test_pictures_of_two_cameras(rig: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    pictures = [picture(tmp_path / f"{c.name}.png", along_thread(c, (0.0, 0.0, 0.5)), rng) for c in CAMERAS]
    out = tmp_path / "gravity"
    assert main(["calibrate", "gravity", *map(str, pictures), "--camera", str(rig), "--out", str(out), "-q"]) == 0
    made = read_calibration(out)
    assert made.gravity_world is not None
    assert angle_deg(made.gravity_world) < 0.1
    assert np.linalg.norm(made.gravity_world) == pytest.approx(9.80665)
    vector, covariance = read_gravity(out)
    np.testing.assert_array_equal(vector, made.gravity_world)
    np.testing.assert_array_equal(covariance, made.gravity_covariance)
    assert "gravity in the first camera" in (out / "calibration.html").read_text(encoding="utf-8")


def test_points_know_how_well_they_say_it(rig: Path, tmp_path: Path) -> None:
    """Over 40 drawings, errors of two components are as large as stated."""
    chi_square = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        lines = ["camera,line,x_px,y_px"]
        for c, camera in enumerate(CAMERAS):
            for line, x in enumerate((-0.02, 0.02)):
                points = along_thread(camera, (x, 0.0, 0.5))[::40]
                lines += [f"{c + 1},{line},{x},{y}" for x, y in points + rng.normal(0, 0.3, points.shape)]
        path, out = tmp_path / f"{seed}.csv", tmp_path / f"out{seed}"
        path.write_text("\n".join(lines), encoding="utf-8")
        assert main(["calibrate", "gravity", str(path), "--camera", str(rig), "--out", str(out), "-q"]) == 0
        made = read_calibration(out)
        assert made.gravity_world is not None
        assert made.gravity_covariance is not None
        off = made.gravity_world - 9.80665 * DOWN
        chi_square.append(float(off @ np.linalg.pinv(made.gravity_covariance, rcond=1e-9) @ off))
    assert 1.3 < np.mean(chi_square) < 2.9
    assert np.mean(np.array(chi_square) < 5.99) > 0.85


def test_one_thread_and_no_thread_are_refused(rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(2)
    camera = tmp_path / "camera"
    camera.mkdir()
    write_calibration(Calibration(cameras=CAMERAS[:1]), camera / FILE)
    thread = picture(tmp_path / "thread.png", along_thread(CAMERAS[0], (0.0, 0.0, 0.5)), rng)
    empty = picture(tmp_path / "empty.png", np.zeros((2, 2)) - 99, rng)
    words = [
        ((thread,), camera, f"{thread}: expected a plumb line seen from two directions"),
        ((thread, empty), camera, f"{empty}: expected a plumb line across the picture"),
        ((thread,), rig, f"{thread}: expected a picture or folder for each of the 2 cameras"),
    ]
    for pictures, calibration, said in words:
        assert main(["calibrate", "gravity", *map(str, pictures), "--camera", str(calibration), "--out", str(tmp_path / "o")]) == 2
        assert said in capsys.readouterr().err
        assert not (tmp_path / "o").exists()
    (tmp_path / "p.csv").write_text("camera,line,x_px,y_px\n1,1,5\n", encoding="utf-8")
    assert main(["calibrate", "gravity", str(tmp_path / "p.csv"), "--camera", str(camera), "--out", str(tmp_path / "o")]) == 2
    assert "line 2: expected camera (from 1), line, x_px and y_px" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("reading", "turn"),
    [("3,0±0.1", [np.deg2rad(3.0), 0.0, 0.0]), ("0,-2±0.1", [0.0, 0.0, np.deg2rad(-2.0)])],
)
def test_a_level_on_the_camera(reading: str, turn: list[float], tmp_path: Path) -> None:
    """A camera that was turned up, or anticlockwise as seen from behind, from where it looked level."""
    out = tmp_path / "gravity"
    assert main(["calibrate", "gravity", f"--level={reading}", "--out", str(out), "-q"]) == 0
    vector, covariance = read_gravity(out)
    R_level_camera = Rotation.from_rotvec(turn).as_matrix()
    np.testing.assert_allclose(vector, 9.80665 * R_level_camera.T @ [0.0, 1.0, 0.0], atol=1e-12)
    assert covariance is not None
    np.testing.assert_allclose(covariance @ vector, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.sort(np.linalg.eigvalsh(covariance))[1:], (9.80665 * np.deg2rad(0.1)) ** 2)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--level", "1±0.1"], "expected PITCH,ROLL±SIGMA in degrees"),
        (["--level", "0,0"], "expected PITCH,ROLL±SIGMA in degrees"),
        (["--level", "0,120±1"], "expected PITCH,ROLL±SIGMA in degrees"),
        (["--level", "0,nan±1"], "expected PITCH,ROLL±SIGMA in degrees"),
        ([], "expected pictures of a plumb line with --camera, or --level"),
        (["picture.png"], "expected pictures of a plumb line with --camera, or --level"),
    ],
)
def test_levels_that_say_nothing(words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "gravity", *words, "--out", str(tmp_path / "gravity")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "gravity").exists()
