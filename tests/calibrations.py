"""Cameras, boards and pictures of them that tests of calibration share."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from datasets.vocabulary.board import Board
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from estimator.calibration.sighting import BoardSighting
from synth.targets.board_pictures import Look, board_picture

Array = NDArray[np.float64]
Pose = tuple[Array, Array]
BOARD = Board(8, 6, 5e-3, 3.7e-3, "DICT_5X5_250")
LENS = Intrinsics(320, 240, 900.0, 905.0, 163.0, 117.0, (-0.15, 0.1, 5e-4, -4e-4, 0.0))
WIDTH_M = 0.04


def placements(count: int, rng: np.random.Generator, *, tilt_rad: float = 0.7, distance_m: float = 0.13) -> list[Pose]:
    """Places of the board in front of a camera at the origin, tilted by up to ``tilt_rad`` about two axes."""
    poses = []
    for _ in range(count):
        angles = [rng.uniform(0, 2 * np.pi), *rng.uniform(-tilt_rad, tilt_rad, 2)]
        R = Rotation.from_euler("zxy", angles).as_matrix()
        middle = np.array([*rng.uniform(-0.2, 0.2, 2) * WIDTH_M, distance_m * rng.uniform(0.95, 1.4)])
        poses.append((R, middle - R @ np.array([BOARD.size_m[0] / 2, BOARD.size_m[1] / 2, 0.0])))
    return poses


def ring(count: int, rng: np.random.Generator, lens: Intrinsics = LENS) -> list[HsvCamera]:
    """Cameras 60 degrees apart or less that look at one place, in the first one's frame."""
    cameras = []
    centre = np.array([0.0, 0.0, 0.15])
    for c in range(count):
        R = Rotation.from_euler("yxz", [0.6 * c * (-1) ** c, 0.0, 0.1 * c]).as_matrix() if c else np.eye(3)
        shift = rng.normal(0, 1e-3, 3) if c else np.zeros(3)
        cameras.append(HsvCamera(f"cam{c}", lens, R, centre - R @ centre + shift))
    return cameras


def seen(cameras: Sequence[HsvCamera], poses: Sequence[Pose], sigma_px: float, rng: np.random.Generator) -> tuple[BoardSighting, ...]:
    """Exact corners with noise, those inside of the pictures; no corner is seen from behind."""
    found = []
    for c, camera in enumerate(cameras):
        for p, (R, t) in enumerate(poses):
            R_cam, t_cam = camera.R_cam_world @ R, camera.R_cam_world @ t + camera.t_cam_world
            points = camera.intrinsics.project(BOARD.corners_m @ R_cam.T + t_cam)
            inside = ((points > 5) & (points < [camera.intrinsics.width_px - 5, camera.intrinsics.height_px - 5])).all(axis=1)
            if np.count_nonzero(inside) >= 12 and abs(R_cam[2, 2]) > 0.35:
                noisy = points[inside] + rng.normal(0, sigma_px, (int(inside.sum()), 2))
                found.append(BoardSighting(c, p, np.flatnonzero(inside), noisy))
    return tuple(found)


def write_pictures(folder: Path, camera: HsvCamera, poses: Sequence[Pose], rng: np.random.Generator, board: Board = BOARD) -> Path:
    """A folder of PNG pictures of the board in these places."""
    folder.mkdir(parents=True, exist_ok=True)
    for p, (R, t) in enumerate(poses):
        pose = (camera.R_cam_world @ R, camera.R_cam_world @ t + camera.t_cam_world)
        Image.fromarray(board_picture(board, camera.intrinsics, pose, Look(), rng)).save(folder / f"{p:02d}.png")
    return folder
