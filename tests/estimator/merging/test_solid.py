"""How far the hull's volume may be off where drops show the particle from the same directions again."""

import numpy as np

from datasets.vocabulary.outline import Outline
from estimator.merging.solid import solid_figures, ways_of_looking
from tests.estimator.exact import ellipsoid_outlines, rig

SEMI_AXES = np.array([4e-3, 3e-3, 2.5e-3])
NOISE_PX = 0.05


def test_views_from_the_same_directions_do_not_make_the_volume_surer() -> None:
    """A stone that lies alike in three drops is seen from six directions, not from eighteen."""
    rng, views = np.random.default_rng(0), rig(1) * 3
    outlines = [Outline(o.points_px + rng.normal(0.0, NOISE_PX, o.points_px.shape)) for o in ellipsoid_outlines(SEMI_AXES, views)]
    true = 4.0 / 3.0 * np.pi * float(np.prod(SEMI_AXES))
    thrice, once = (solid_figures(outlines[:n], views[:n], np.random.default_rng(1)) for n in (18, 6))
    assert thrice.excess > 0.5 * once.excess
    assert abs(thrice.volume_m3 - true) < 3.0 * thrice.volume_sigma_m3


def test_ways_of_looking_are_directions_to_the_body_or_their_opposites() -> None:
    views = rig(1)
    assert sorted(ways_of_looking(views, np.zeros(3))) == list(range(6))
    assert ways_of_looking(views * 2, np.zeros(3)).tolist() == [0, 1, 2, 3, 4, 5] * 2
