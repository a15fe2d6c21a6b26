"""Derivatives of made samples, each of which meets one edge of a mesh as real ones do."""

import numpy as np
from scipy.sparse import csr_array

from estimator.surface.star_surface import Sphere


def by_corner(ball: Sphere, count: int, rng: np.random.Generator) -> csr_array:
    """Random derivatives (count, 3 n) px/m of samples by both ends of a random edge each."""
    ends = ball.mesh.ends[rng.integers(len(ball.mesh.ends), size=count)]
    columns = (3 * ends[:, :, None] + np.arange(3)).ravel()
    return csr_array((1e3 * rng.normal(size=6 * count), (np.repeat(np.arange(count), 6), columns)), (count, 3 * len(ball.directions)))
