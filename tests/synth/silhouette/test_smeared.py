"""Outlines of smeared pictures: the level moves an edge by its share of the motion, however slow that is."""

import numpy as np
import pytest

from synth.silhouette import grid_around, level_outline, quantile_coverage

MIDDLE = np.array([50.3, 40.7])
CORNER = np.radians(17.0)
SIDE = np.array([np.cos(CORNER + np.pi / 4), np.sin(CORNER + np.pi / 4)])
"""Outward normal of one side of the square."""


def drawn_side_px(way_px: float, level: float, *, outlines: int = 16) -> float:
    """How far out the side of a square lies that moves ``way_px`` to the right, less where its middle does."""
    angles = CORNER + 0.5 * np.pi * np.arange(4)
    square = MIDDLE + 20.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    moved = [square + np.array([way_px * ((k + 0.5) / outlines - 0.5), 0.0]) for k in range(outlines)]
    grid = grid_around(np.vstack(moved), 2.0, 8)
    outline = level_outline(quantile_coverage(moved, grid, level), grid, 0.5) - MIDDLE
    along = outline @ np.array([-SIDE[1], SIDE[0]])
    return float(np.mean((outline @ SIDE)[(np.abs(along) < 8.0) & (outline @ SIDE > 0.0)]) - 20.0 * np.cos(np.pi / 4))


@pytest.mark.parametrize("way_px", [0.0, 0.02, 0.3, 1.0])
@pytest.mark.parametrize("bias", [-0.35, -0.1, 0.0, 0.3])
def test_an_edge_moves_by_the_bias_of_the_level_times_its_way(way_px: float, bias: float) -> None:
    """The mean of the pictures is off by 0.05 px where nothing moves and the level is 0.2: it is the grid's own ramp."""
    assert drawn_side_px(way_px, 0.5 - bias) == pytest.approx(bias * way_px * SIDE[0], abs=5e-4)
