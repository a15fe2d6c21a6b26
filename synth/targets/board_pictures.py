"""A flat board as a calibrated camera sees it: every pixel averages points of its area, each looked up where its ray meets the board.

Blur is that of a Gaussian spot, noise is white. Not modelled: depth of field, shading, a board that is not flat.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.board import Board
from datasets.vocabulary.camera import Intrinsics

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Pose = tuple[Array, Array]

OVERSAMPLING = 3
"""Points per pixel along each axis."""
KEPT_LENSES = 3
"""Of which rays are kept: 80 MB each for a picture of 1024 x 768 px."""
SQUARE_PX = 64
"""Of a square in the picture of the board itself."""
GROUND, FULL_DN = 0.55, 215.0
"""Brightness around the board, and of its white in DN of 8 bit."""


@dataclass(frozen=True)
class Look:
    """How pictures look: ``blur_px`` standard deviation of the spot, ``noise_dn`` of the grey values (of 255)."""

    blur_px: float = 0.7
    noise_dn: float = 3.0


def board_picture(board: Board, lens: Intrinsics, pose: Pose, look: Look, rng: np.random.Generator) -> NDArray[np.uint8]:
    """The board as 8 bit grey (height, width); ``pose``: ``R_cam_board`` (3, 3) and ``t_cam_board`` (3,) m, board to camera."""
    points = _on_board(lens, *pose) * np.float32(SQUARE_PX / board.square_m) - np.float32(0.5)
    texture = _texture(board)
    side = 1024  # OpenCV's remap takes at most 32767 rows
    parts = [
        cv2.remap(texture, p, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=GROUND)
        for p in np.array_split(points, max(1, len(points) // side))
    ]
    fine = np.concatenate(parts)
    grey = fine.reshape(lens.height_px, OVERSAMPLING, lens.width_px, OVERSAMPLING).mean(axis=(1, 3))
    if look.blur_px > 0:
        grey = cv2.GaussianBlur(grey, (0, 0), look.blur_px)
    noisy = FULL_DN * grey + rng.normal(0, look.noise_dn, grey.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def _texture(board: Board) -> Single:
    """The board's face, 0 to 1, without a margin."""
    size = (board.columns * SQUARE_PX, board.rows * SQUARE_PX)
    if board.has_markers:
        return np.asarray(board.charuco().generateImage(size, marginSize=0, borderBits=1) / np.float32(255), dtype=np.float32)
    odd = ((np.arange(board.rows)[:, None] + np.arange(board.columns)) % 2).astype(np.float32)
    return np.asarray(np.repeat(np.repeat(odd, SQUARE_PX, axis=0), SQUARE_PX, axis=1), dtype=np.float32)


def _on_board(lens: Intrinsics, R: Array, t: Array) -> Single:
    """Where the rays of all sample points meet the board's plane (height, width, 2) m; outside of it where they do not."""
    plane = np.column_stack([R[:, :2], t])  # board (x, y, 1) to camera
    met = _rays(lens) @ np.linalg.inv(plane).T.astype(np.float32)
    behind = met[..., 2] <= 0
    met[behind] = (-1.0, -1.0, 1.0)
    return np.asarray(met[..., :2] / met[..., 2:])


@lru_cache(maxsize=KEPT_LENSES)
def _rays(lens: Intrinsics) -> Single:
    """Ideal homogeneous coordinates of all sample points (height, width, 3)."""
    steps = (np.arange(OVERSAMPLING) + 0.5) / OVERSAMPLING - 0.5
    u, v = (np.arange(n)[:, None] + steps for n in (lens.width_px, lens.height_px))
    real = np.stack(np.meshgrid(u.ravel(), v.ravel()), axis=-1)
    ideal = lens.normalise(real.reshape(-1, 2)).astype(np.float32).reshape(real.shape)
    return np.concatenate([ideal, np.ones((*ideal.shape[:2], 1), dtype=np.float32)], axis=2)
