"""The support function of points in a picture: how far they reach along directions."""

import numba
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Array = NDArray[np.float64]


def support(points: Float[Array, "n 2"], outward: Float[Array, "d 2"]) -> Float[Array, " d"]:
    """Furthest place (d,) of some points along each direction, without the matrix of all of them; minus infinity of no points."""
    return np.asarray(_support(np.ascontiguousarray(points, dtype=np.float64), np.ascontiguousarray(outward.T)))


@numba.njit(cache=True, fastmath={"contract"})
def _support(points, outward):  # type: ignore[no-untyped-def]
    """Directions (2, d) are the inner loop, which processors do four at a time."""
    furthest = np.full(outward.shape[1], -np.inf)
    for j in range(len(points)):
        x, y = points[j, 0], points[j, 1]
        for d in range(outward.shape[1]):
            reach = x * outward[0, d] + y * outward[1, d]
            furthest[d] = reach if reach > furthest[d] else furthest[d]
    return furthest
