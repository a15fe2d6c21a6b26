"""Rows exposed one after the other [Ait-Aider et al. 2006]: row y at ``t + line_time (y - (height - 1) / 2)``.

The body is where it is when the middle row of its outline is exposed. Rows above and below are exposed a little earlier and later; every
point of the outline as it was seen is moved back by what the body's point there travels in between, and the tangent of what comes out is
the one at the middle row's time. What the hull says of the body enters through the depth of those points alone, so an error of it does
not decide which corner a tangent touches.
"""

import numpy as np
from numpy.typing import NDArray

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
        seen = places.outline_px
        row = seen[..., 1] - (places.camera.height_px - 1) / 2 - places.rows_px[:, None]
        still = seen - theta[0] * row[..., None] * _velocity_px(places)
        near = _near(places)
        sighting = np.arange(len(seen))[:, None, None, None]
        reach = [np.einsum("nkmi,nkmai->nkma", places.normal, points[sighting, near]).max(axis=-1) for points in (seen, still)]
        return np.asarray(reach[0] - reach[1])


def _near(places: Places) -> NDArray[np.int64]:
    """Which of the outline's points (n, k, 2, a) may touch the tangents, before and after."""
    number = len(places.outward)
    reach = int(np.ceil(TURNED / (2.0 * np.pi) * number))
    towards = np.rint(np.arctan2(places.normal[..., 1], places.normal[..., 0]) / (2.0 * np.pi) * number).astype(np.int64)
    return np.asarray((towards[..., None] + np.arange(-reach, reach + 1)) % number)


def _velocity_px(places: Places) -> Array:
    """Velocity (n, a, 2) px/s in the picture of the body's points at the outline's."""
    moving, camera = places.moving, places.camera
    focal, middle = np.array([camera.fx_px, camera.fy_px]), np.array([camera.cx_px, camera.cy_px])
    depth = moving.centre_cam[:, None, 2:] + moving.arms_towards(places.outward)[..., 2:]
    place = np.concatenate([(places.outline_px - middle) / focal * depth, depth], axis=-1)
    return moving.velocity_px(place - moving.centre_cam[:, None], focal)
