"""Flat calibration targets: a chessboard, or a ChArUco board whose white squares hold markers with numbers.

Board coordinates (m): origin at the board's outer corner, x along a row, y down a column, z = 0. A ChArUco board is that of OpenCV 4.6 and
later (no *legacy pattern*) [Garrido-Jurado et al. 2014].
"""

import re
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.errors import InputError

MOST_SQUARES = 100
"""Along a side: no printed board has more, and a slip of the finger does."""
FORMS = (
    "charuco:12x9:5mm:3.7mm:DICT_5X5_250 (squares, their side, the markers' side, OpenCV's dictionary), "
    "or chessboard:9x6:5mm (inner corners, side of a square)"
)


@dataclass(frozen=True)
class Board:
    """``columns`` x ``rows`` squares of ``square_m``; with ``marker_m`` and ``dictionary`` a ChArUco board, else a chessboard."""

    columns: int
    rows: int
    square_m: float
    marker_m: float = 0.0
    dictionary: str = ""

    @property
    def has_markers(self) -> bool:
        """Whether it is a ChArUco board."""
        return bool(self.dictionary)

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height (m)."""
        return self.columns * self.square_m, self.rows * self.square_m

    @property
    def corners_m(self) -> Float[NDArray[np.float64], "corner 3"]:
        """Inner corners in board coordinates (m), row by row."""
        x, y = np.meshgrid(np.arange(1, self.columns) * self.square_m, np.arange(1, self.rows) * self.square_m)
        return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])

    def charuco(self) -> cv2.aruco.CharucoBoard:
        """The same board as OpenCV has it."""
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, dictionary)

    @property
    def words(self) -> str:
        """The board as a person types it."""
        if self.has_markers:
            return f"charuco:{self.columns}x{self.rows}:{self.square_m * 1e3:g}mm:{self.marker_m * 1e3:g}mm:{self.dictionary}"
        return f"chessboard:{self.columns - 1}x{self.rows - 1}:{self.square_m * 1e3:g}mm"


def board_of(text: str) -> Board:
    """The board of its words; a chessboard is counted by inner corners, as OpenCV does.

    Raises
    ------
    InputError
        Where the words are none of the forms, or no such board can be printed.
    """
    length = r"([0-9]+(?:\.[0-9]+)?)mm"
    charuco = re.fullmatch(rf"charuco:([0-9]{{1,3}})x([0-9]{{1,3}}):{length}:{length}:(DICT_[0-9A-Za-z_]+)", text)
    chess = re.fullmatch(rf"chessboard:([0-9]{{1,3}})x([0-9]{{1,3}}):{length}", text)
    if charuco is not None:
        board = Board(int(charuco[1]), int(charuco[2]), float(charuco[3]) * 1e-3, float(charuco[4]) * 1e-3, charuco[5])
    elif chess is not None:
        board = Board(int(chess[1]) + 1, int(chess[2]) + 1, float(chess[3]) * 1e-3)
    else:
        raise InputError(f"--board {text}: expected {FORMS}.")
    _check(text, board)
    return board


def _check(text: str, board: Board) -> None:
    if not (3 <= board.columns <= MOST_SQUARES and 3 <= board.rows <= MOST_SQUARES and board.square_m > 0):
        raise InputError(f"--board {text}: expected 3 to {MOST_SQUARES} squares along each side, of a size above 0, got others.")
    if not board.has_markers:
        return
    if not 0 < board.marker_m < board.square_m:
        raise InputError(f"--board {text}: expected markers smaller than the squares, got {board.marker_m * 1e3:g} mm.")
    if not isinstance(getattr(cv2.aruco, board.dictionary, None), int):
        raise InputError(f"--board {text}: expected one of OpenCV's dictionaries, as DICT_5X5_250, got {board.dictionary}.")
    held = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary)).bytesList)
    if held < board.columns * board.rows // 2:
        raise InputError(f"--board {text}: expected a dictionary of {board.columns * board.rows // 2} markers or more, got {held}.")
