"""What carved hulls say of leaks of light, against the bodies they were carved from."""

import numpy as np
import pytest

from estimator.geometry.outline_shape import as_of_a_hull, outline_shape
from scripts.trials.study_hull_leaks import DEPTH, body_row

BODIES = {"stone": ("cut_stone", 0.5), "jagged": ("jagged", 0.5), "very jagged": ("jagged", 0.8)}


@pytest.mark.parametrize("body", BODIES)
def test_nature_varies_as_much_as_a_hull_says_of_it(body: str) -> None:
    """Otherwise the size of a leak, fitted with what the hull says, would be attenuated."""
    found = body_row(*BODIES[body], seed=3)
    assert abs(found["hull"][0] - found["nature"][0]) < 0.06
    assert 0.4 < found["slope_drawn_in"] < 1.8


def test_hollows_draw_leaks_towards_their_mean_and_leave_it() -> None:
    star = 40.0 * np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0.0, 2.0 * np.pi, 10, endpoint=False)])
    star[1::2] *= 0.5
    whole, hollow = [2.0 * star[::2]], [star]
    for polygons, most in ((whole, 0.95), (hollow, 0.55)):
        shape = outline_shape(polygons)
        found = as_of_a_hull(shape, polygons)
        np.testing.assert_allclose(found.leak.mean(axis=(0, 1)), shape.leak.mean(axis=(0, 1)))
        assert float(np.ptp(found.leak[..., DEPTH])) < most * float(np.ptp(shape.leak[..., DEPTH]))
        np.testing.assert_array_equal(found.erosion, shape.erosion)
