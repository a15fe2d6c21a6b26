"""Rows exposed one after the other [Ait-Aider et al. 2006]: row y at ``t + line_time (y - (height - 1) / 2)``.

The body is where it is when the middle row of its outline is exposed. Rows above and below are exposed a little earlier and later; every
point of the outline as it was seen is moved back by what the body's point there travels in between, and the tangent of what comes out is
the one at the middle row's time. What the hull says of the body enters through the depth of those points alone, so an error of it does
not decide which corner a tangent touches.

``t(y) = t + line_time (y - (height - 1) / 2)``. Valid where the body turns little from its first row to its last.
"""

import numba
import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting

TURNED = np.radians(12.0)
"""Largest turn of a tangent by the shear: what a body does that crosses a fifth of its rows' way in their time."""


class RollingShutter(EffectModel):
    """Delays of whole outlines, and outline displacement by the movement since their middle row."""

    entry = EFFECTS["rolling_shutter"]
    accuracy = 0.01

    def delays(self, theta: Array, rows_px: Array) -> Array | None:
        """When the middle rows of outlines are exposed."""
        return np.asarray(theta[0] * rows_px)

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """How much further along ``u`` the outline reaches as it was seen than if all of it were exposed at its middle row's time."""
        del setting
        if theta[0] == 0.0:
            return np.zeros(places.normal.shape[:-1])
        seen, normal = places.outline_px, places.normal
        row = seen[..., 1] - places.seen.middle_px[:, 1:] - places.rows_px[:, None]
        still = seen - theta[0] * row[..., None] * places.outline_velocity_px
        number = len(places.outward)
        towards = np.rint(np.nan_to_num(np.arctan2(normal[..., 1], normal[..., 0])) / (2.0 * np.pi) * number).astype(np.int64)
        beside = int(np.ceil(TURNED / (2.0 * np.pi) * number))
        return np.asarray(_reach(seen, normal, towards, beside) - _reach(still, normal, towards, beside))

    def displaced(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """How far the body's points have moved since the middle row was exposed."""
        del setting
        row = places.point_px[..., 1] - places.seen.middle_px[:, 1, None, None] - places.rows_px[:, None, None]
        return np.asarray(theta[0] * row * np.sum(places.normal * places.velocity_px, axis=-1))


@numba.njit(cache=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _furthest(x, y, ux, uy):  # type: ignore[no-untyped-def]
    reach = -np.inf
    for a in range(len(x)):
        along = ux * x[a] + uy * y[a]
        reach = along if along > reach else reach
    return reach


@numba.njit(cache=True)
def _reach(points, normal, towards, beside):  # type: ignore[no-untyped-def]
    """How far (n, k, 2) px points (n, a, 2) reach along unit normals (n, k, 2, 2), of those ``beside`` the direction ``towards``."""
    n, k, two, _ = normal.shape
    number = points.shape[1]
    reach = np.full((n, k, two), np.nan)
    for i in range(n):
        if np.isnan(points[i]).any():  # of a flight led astray
            continue
        around = np.concatenate((points[i, number - beside :], points[i], points[i, :beside]))
        x, y = around[:, 0].copy(), around[:, 1].copy()
        for j in range(k):
            for side in range(two):
                first = towards[i, j, side] % number
                window = slice(first, first + 2 * beside + 1)
                reach[i, j, side] = _furthest(x[window], y[window], normal[i, j, side, 0], normal[i, j, side, 1])
    return reach
