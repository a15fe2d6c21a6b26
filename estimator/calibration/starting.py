"""Where a bundle adjustment starts: each lens by Zhang's method, each pose by PnP, cameras and placements chained over what they share.

Cameras and placements of the board are the nodes of a graph, sightings its edges; shortest paths from the first camera give every pose
[Zhang 2000; Collins & Bartoli 2014 for the pose of a plane].
"""

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.board import Board
from datasets.vocabulary.camera import Intrinsics
from estimator.calibration.bundle import Rig, with_lens
from estimator.calibration.sighting import BoardSighting

Array = NDArray[np.float64]
Pose = tuple[Array, Array]

FEWEST_PICTURES = 3
"""Of a camera: each picture of a plane gives two equations for four unknowns of a lens [Zhang 2000], and one says whether they fit."""


def start(sightings: tuple[BoardSighting, ...], board: Board, sizes: tuple[tuple[int, int], ...]) -> Rig:
    """A rig near the truth.

    Raises
    ------
    InputError
        Where a camera has too few pictures of the board, or shares no picture with the others.
    """
    lenses = tuple(_lens(c, [s for s in sightings if s.camera == c], board, size) for c, size in enumerate(sizes))
    seen = {(s.camera, s.picture): pose_of(s, board, lenses[s.camera]) for s in sightings}
    cameras, boards = _chained(seen, len(sizes))
    order = sorted(boards)
    return Rig(
        lenses,
        np.stack([cameras[c][0] for c in range(len(sizes))]),
        np.stack([cameras[c][1] for c in range(len(sizes))]),
        np.stack([boards[p][0] for p in order]),
        np.stack([boards[p][1] for p in order]),
    )


def _lens(camera: int, sightings: list[BoardSighting], board: Board, size: tuple[int, int]) -> Intrinsics:
    """A lens by OpenCV, without distortion: what is missing comes from the bundle adjustment."""
    if len(sightings) < FEWEST_PICTURES:
        raise InputError(f"camera {camera + 1}: expected {FEWEST_PICTURES} pictures that show the board or more, got {len(sightings)}.")
    objects = [board.corners_m[s.corners].astype(np.float32) for s in sightings]
    images = [s.points_px.astype(np.float32) for s in sightings]
    flags = cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_PRINCIPAL_POINT
    centre = ((size[0] - 1) / 2, (size[1] - 1) / 2)
    usual = float(max(size))
    K = np.array([[usual, 0.0, centre[0]], [0.0, usual, centre[1]], [0.0, 0.0, 1.0]])
    guess = cv2.initCameraMatrix2D([o[:, None] for o in objects], [i[:, None] for i in images], size, 1.0)
    if np.isfinite(guess).all() and 0.1 * usual < guess[0, 0] < 1e3 * usual:
        K[0, 0] = K[1, 1] = guess[0, 0]
    try:
        _, K, distortion, _, _ = cv2.calibrateCamera(objects, images, size, K, np.zeros(5), flags=flags | cv2.CALIB_USE_INTRINSIC_GUESS)
    except cv2.error as error:
        raise InputError(f"camera {camera + 1}: expected corners of a flat board, got ones that fit none ({error.err}).") from None
    k1 = float(distortion.ravel()[0])
    lens = Intrinsics(size[0], size[1], 1.0, 1.0, 0.0, 0.0)
    return with_lens(lens, np.array([K[0, 0], K[1, 1], *centre, k1, 0.0, 0.0, 0.0, 0.0]))


def pose_of(sighting: BoardSighting, board: Board, lens: Intrinsics) -> Pose:
    """Rotation and place (m) from the board to the camera."""
    points = lens.normalise(sighting.points_px)
    _, turn, shift = cv2.solvePnP(board.corners_m[sighting.corners], points, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    return np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64), np.asarray(shift, dtype=np.float64).ravel()


def _chained(seen: dict[tuple[int, int], Pose], count: int) -> tuple[dict[int, Pose], dict[int, Pose]]:
    """Poses of cameras (from the world) and of boards (to the world), the first camera being the world."""
    cameras: dict[int, Pose] = {0: (np.eye(3), np.zeros(3))}
    boards: dict[int, Pose] = {}
    waiting = deque([("camera", 0)])
    while waiting:
        kind, number = waiting.popleft()
        for (c, p), (R, t) in seen.items():
            if kind == "camera" and c == number and p not in boards:
                R_cam, t_cam = cameras[c]
                boards[p] = (R_cam.T @ R, R_cam.T @ (t - t_cam))
                waiting.append(("board", p))
            if kind == "board" and p == number and c not in cameras:
                R_board, t_board = boards[p]
                R_cam = R @ R_board.T
                cameras[c] = (R_cam, t - R_cam @ t_board)
                waiting.append(("camera", c))
    apart = [str(c + 1) for c in range(count) if c not in cameras]
    if apart:
        raise InputError(
            f"camera {', '.join(apart)}: expected pictures of the board taken at one instant with another camera of the rig, got none; "
            "pictures of all cameras are paired by their numbers."
        )
    return cameras, boards
