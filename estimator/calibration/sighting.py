"""Corners of a board in a picture."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from datasets.vocabulary.board import Board

FEWEST_CORNERS = 8
"""A pose of a plane needs four; twice as many say whether they fit."""
SMALLEST_WINDOW, SUB_PIXEL_WINDOW = 2, 5
"""Half the side (px) of the window in which a corner is refined. The next marker or corner must not reach into it."""
CHESSBOARD_FREE = 0.4
"""Of a square of a chessboard, what a window around a corner may take: half of it, less a blurred edge."""


@dataclass(frozen=True)
class BoardSighting:
    """What ``camera`` sees of the board in picture ``picture``: numbers of corners (n,) and where they are (n, 2) px."""

    camera: int
    picture: int
    corners: Int[NDArray[np.int64], " n"]
    points_px: Float[NDArray[np.float64], "n 2"]


def find_board(grey: NDArray[np.uint8], board: Board) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Numbers (n,) and places (n, 2) px of the board's inner corners; none where no board is seen.

    ChArUco boards may be seen in part, chessboards as a whole only, and a chessboard's turn by 180° cannot be told.
    ``grey`` (height, width).
    """
    found = _charuco(grey, board) if board.has_markers else _chessboard(grey, board)
    return found if len(found[0]) >= FEWEST_CORNERS else (np.zeros(0, dtype=np.int64), np.zeros((0, 2)))


def _charuco(grey: NDArray[np.uint8], board: Board) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(board.charuco()).detectBoard(grey)
    if numbers is None or len(numbers) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros((0, 2))
    ids = np.asarray(numbers, dtype=np.int64).ravel()
    return ids, _refined(grey, np.asarray(corners, dtype=np.float32).reshape(-1, 2), 0.5 * (1 - board.marker_m / board.square_m))


def _chessboard(grey: NDArray[np.uint8], board: Board) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    size = (board.columns - 1, board.rows - 1)
    whole, corners = cv2.findChessboardCornersSB(grey, size, flags=cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not whole:
        return np.zeros(0, dtype=np.int64), np.zeros((0, 2))
    return np.arange(size[0] * size[1]), _refined(grey, np.asarray(corners, dtype=np.float32).reshape(-1, 2), CHESSBOARD_FREE)


def _refined(grey: NDArray[np.uint8], corners: NDArray[np.float32], free: float) -> NDArray[np.float64]:
    """Saddle points of the grey values around ``corners``, in a window that holds only what is within ``free`` squares of a corner."""
    if len(corners) < 2:
        return corners.astype(np.float64)
    apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    spacing = float(np.partition(apart, 1, axis=1)[:, 1].min())
    half = int(np.clip(free * spacing, SMALLEST_WINDOW, SUB_PIXEL_WINDOW))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-4)
    refined = cv2.cornerSubPix(grey, corners.reshape(-1, 1, 2).copy(), (half, half), (-1, -1), criteria)
    return np.asarray(refined, dtype=np.float64).reshape(-1, 2)
