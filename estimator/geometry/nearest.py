"""Which point of a curve is nearest to each of others, by square buckets: a tree takes longer to build and to ask."""

import numba
import numpy as np


@numba.njit(cache=True)
def nearest(curve, points, size):  # type: ignore[no-untyped-def]
    """Which (s,) of the points of a ``curve`` (n, 2) is nearest to each of ``points`` (s, 2), by buckets of some ``size``.

    Any size finds the same; points are numbers, or the search would never end.
    """
    low_x, low_y = curve[:, 0].min(), curve[:, 1].min()
    wide, high = int((curve[:, 0].max() - low_x) / size) + 1, int((curve[:, 1].max() - low_y) / size) + 1
    head, following = np.full((high, wide), -1, np.int64), np.empty(len(curve), np.int64)
    for i in range(len(curve) - 1, -1, -1):
        y, x = int((curve[i, 1] - low_y) / size), int((curve[i, 0] - low_x) / size)
        following[i], head[y, x] = head[y, x], i
    found = np.empty(len(points), np.int64)
    for k in range(len(points)):
        x0, y0 = int(np.floor((points[k, 0] - low_x) / size)), int(np.floor((points[k, 1] - low_y) / size))
        best, at, ring = np.inf, -1, max(0, -x0, -y0, x0 - wide + 1, y0 - high + 1)
        while at < 0 or (max(ring - 1, 0) * size) ** 2 <= best:
            for y in range(max(y0 - ring, 0), min(y0 + ring, high - 1) + 1):
                whole = abs(y - y0) == ring
                for x in range(x0 - ring, x0 + ring + 1, 1 if whole or ring == 0 else 2 * ring):
                    i = head[y, x] if 0 <= x < wide else -1
                    while i >= 0:
                        far = (curve[i, 0] - points[k, 0]) ** 2 + (curve[i, 1] - points[k, 1]) ** 2
                        if far < best:
                            best, at = far, i
                        i = following[i]
            ring += 1
        found[k] = at
    return found
