"""Where a biased threshold puts edges that are blurred at rest and by a motion, against pictures drawn and measured."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from estimator.effects.catalogue.exposure.motion_blur_threshold import displaced
from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.coverage import coverage
from estimator.outlines.pictures.contour import PIXEL_VARIANCE, edge_blur, half_level_contour, refined

RADIUS_PX = 30.0
INSTANTS = 16


def measured(bias, blur_px, moved_px):
    """Displacement along and across the motion of a disc's outline, and the width of its edges, in a picture whose response is bent."""
    places = ((np.arange(INSTANTS) + 0.5) / INSTANTS - 0.5) * moved_px
    parts = [coverage(RADIUS_PX * unit_circle(400) + [50.3 + x, 50.7], (100, 100)).astype(np.float64) for x in places]
    dark = gaussian_filter(np.mean(parts, axis=0), blur_px)
    gamma = np.log(0.5) / np.log(0.5 + bias)
    picture = (1.0 - np.clip(1.0 - dark, 0.0, 1.0) ** gamma).astype(np.float32)
    contour = half_level_contour(picture)
    edge = refined(contour, picture, blur_px=edge_blur(contour, picture), spacing_px=1.0, rounds=4)
    return np.ptp(edge.points_px, axis=0) / 2 - RADIUS_PX, np.sqrt(edge.blur_px**2 + PIXEL_VARIANCE)


@pytest.mark.parametrize(("bias", "blur_px", "moved_px"), [(0.27, 0.8, 3.0), (0.27, 1.2, 1.5), (-0.2, 0.8, 2.0), (0.1, 0.6, 2.0)])
def test_edges_are_where_their_blur_and_the_motion_reach_the_level(bias, blur_px, moved_px):
    """Not where the motion alone does: 3 px displace by 0.3 px more than none, of the 0.8 px that they would alone."""
    (along, across), edge_px = measured(bias, blur_px, moved_px)
    predicted = displaced(bias, np.array([moved_px, 0.0]), edge_px)
    np.testing.assert_allclose([along, across], predicted, rtol=0.05)
    assert along - across == pytest.approx(predicted[0] - predicted[1], rel=0.2)
    assert abs(along - across) < 0.6 * abs(bias * moved_px)


@pytest.mark.parametrize("bias", [-0.4, -0.1, 0.2, 0.4])
def test_blur_that_is_small_beside_the_motion_does_nothing(bias):
    moved = np.array([0.5, 2.0, 5.0])
    np.testing.assert_allclose(displaced(bias, moved, 0.0), bias * moved)
    np.testing.assert_allclose(displaced(bias, moved, 1e-3), bias * moved, atol=1e-6)
    assert displaced(bias, moved, 0.02) == pytest.approx(bias * moved, abs=0.01)


def test_each_sighting_is_displaced_by_the_blur_of_its_own_picture():
    """A particle that leaves the focus is displaced by more, however it moves."""
    moved = np.broadcast_to(np.array([0.0, 1.0, 3.0]), (4, 3))
    widths = np.array([0.3, 0.4, 0.6, 0.8])
    together = displaced(0.24, moved, widths[:, None])
    np.testing.assert_array_equal(together, [displaced(0.24, row, width) for row, width in zip(moved, widths, strict=True)])
    assert (np.diff(together, axis=0) > 0.01).all()
