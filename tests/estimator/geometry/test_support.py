"""How far points reach along directions."""

import numpy as np

from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.support import support


def test_it_is_the_largest_of_all_products() -> None:
    points, outward = np.random.default_rng(1).normal(size=(57, 2)), unit_circle(31)
    np.testing.assert_allclose(support(points, outward), (points @ outward.T).max(axis=0), rtol=1e-14)
    np.testing.assert_allclose(support(points[::-2].T.copy().T, outward), (points[::-2] @ outward.T).max(axis=0), rtol=1e-14)
    assert np.isneginf(support(np.zeros((0, 2)), outward)).all()
