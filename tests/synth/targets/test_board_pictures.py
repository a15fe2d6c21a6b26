"""Drawn boards show their corners where the camera projects them."""

import numpy as np

from datasets.vocabulary.board import Board
from estimator.calibration.sighting import find_board
from synth.targets.board_pictures import Look, board_picture
from tests.calibrations import BOARD, LENS, placements


def test_corners_lie_where_the_camera_projects_them():
    rng = np.random.default_rng(1)
    off = []
    for R, t in placements(6, rng):
        numbers, points = find_board(board_picture(BOARD, LENS, (R, t), Look(noise_dn=1.0), rng), BOARD)
        off.append(points - LENS.project(BOARD.corners_m[numbers] @ R.T + t))
    every = np.concatenate(off)
    assert len(every) > 100
    assert np.abs(every.mean(axis=0)).max() < 0.01
    assert every.std() < 0.06


def test_a_chessboard_has_the_corners_of_its_markers_board():
    plain = Board(BOARD.columns, BOARD.rows, BOARD.square_m)
    rng = np.random.default_rng(2)
    R, t = placements(1, rng, tilt_rad=0.3, distance_m=0.17)[0]
    numbers, points = find_board(board_picture(plain, LENS, (R, t), Look(), rng), plain)
    assert len(numbers) == 35
    expected = LENS.project(plain.corners_m @ R.T + t)
    turned = min((points, points[::-1]), key=lambda p: float(np.abs(p - expected).max()))
    assert np.abs(turned - expected).max() < 0.25


def test_what_lies_behind_a_camera_is_not_drawn():
    picture = board_picture(BOARD, LENS, (np.eye(3), np.array([0.0, 0.0, -0.2])), Look(noise_dn=0.0), np.random.default_rng(3))
    assert picture.min() == picture.max()
