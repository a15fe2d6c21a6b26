"""What an outline's own points do under blur, leaks and smear: on circles and sides as theory has it, at corners more."""

import numpy as np
import pytest

from estimator.appearance.sector_shape import SectorRuler, sector_shape, sectors_of
from estimator.geometry.outline_shape import BLURS_PX, DEPTHS_PX

SECTORS = 64
STILL = np.zeros((1, 3, 2))


def circle(radius_px: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    return np.array([100.0, 80.0]) + radius_px * np.column_stack([np.cos(angle), np.sin(angle)])


SQUARE = np.array([100.0, 80.0]) + 40.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def test_sectors_are_counted_from_the_x_axis_on() -> None:
    assert sectors_of(np.array([[1.0, 0.01], [0.0, 1.0], [-1.0, 0.01], [1.0, -0.01]]), np.zeros(2), 4).tolist() == [0, 1, 1, 3]


def test_a_wider_circle_lies_outside_by_the_difference_of_radii() -> None:
    ruler = SectorRuler(circle(40.0), SECTORS)
    assert ruler.plain(circle(41.5)) == pytest.approx(1.5, abs=0.01)
    assert ruler.plain(circle(38.0)) == pytest.approx(-2.0, abs=0.01)


def test_a_curve_that_ran_away_is_refused() -> None:
    """What is nearest to no number would be looked for without end."""
    curve = circle(41.0)
    curve[3, 0] = np.nan
    with pytest.raises(ValueError, match="got one that ran away"):
        SectorRuler(circle(40.0), SECTORS).plain(curve)


def test_a_circle_recedes_by_its_curvature() -> None:
    shape = sector_shape([circle(40.0)], STILL, SECTORS)
    wide = BLURS_PX[BLURS_PX >= 1.0]
    assert shape.recession[0][:, BLURS_PX >= 1.0] == pytest.approx(np.broadcast_to(wide / 80.0, (SECTORS, len(wide))), rel=0.1, abs=5e-3)
    assert shape.erosion == pytest.approx(1.0, abs=5e-3)
    assert shape.smear == pytest.approx(0.0, abs=0.02)


def test_points_that_recede_stay_nearer_in_a_hollow_than_at_a_side() -> None:
    notch = np.array([100.0, 80.0]) + np.array(
        [[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [3.0, 40.0], [0.0, 34.0], [-3.0, 40.0], [-40.0, 40.0]]
    )
    erosion = sector_shape([notch], STILL, SECTORS).erosion[0][:, list(DEPTHS_PX).index(1.0)]
    assert erosion[[0, 32, 48]] == pytest.approx(1.0, abs=0.01)
    assert 0.7 < erosion[16] < 0.97


def test_corners_recede_and_sides_do_not() -> None:
    shape = sector_shape([SQUARE], STILL, SECTORS)
    two = shape.recession[0][:, list(BLURS_PX).index(2.0)]
    middles, corners = [0, 16, 32, 48], [8, 24, 40, 56]
    assert two[middles] == pytest.approx(0.0, abs=0.01)
    assert np.all(two[corners] > 0.05)
    assert np.all(two[corners] < 0.77)  # what the tangents of a right angle recede


def test_what_moves_across_a_side_is_smeared_no_more_than_the_side_s_movement_says() -> None:
    along_x = np.zeros((1, 3, 2))
    along_x[0, 2, 0] = 6.0
    shape = sector_shape([SQUARE], along_x, SECTORS)
    assert shape.smear[0][[0, 16, 32, 48]] == pytest.approx(0.0, abs=0.05)


def test_the_way_round_does_not_matter() -> None:
    one, other = (sector_shape([each], STILL, SECTORS) for each in (SQUARE, SQUARE[::-1]))
    assert one.recession == pytest.approx(other.recession, abs=0.02)
