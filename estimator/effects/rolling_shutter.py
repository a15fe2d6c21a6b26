"""Rows exposed one after the other [Ait-Aider et al. 2006]: row y at ``t + line_time (y - (height - 1) / 2)``.

A point that is in row ``y`` at the frame's time appears where it is ``line_time (y - middle) / (1 - line_time dy/dt)`` later. Rows that
follow one another shear and turn the body, so that another of its points may touch the tangent: the point furthest along ``u`` of the
body as it appears is, at the frame's time, the one furthest along the normal that the shear and the turn carry into ``u``.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting


class RollingShutter(EffectModel):
    """Outline displacement by the movement since the middle row."""

    entry = EFFECTS["rolling_shutter"]
    accuracy = 0.01

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """How much further along ``u`` the body reaches as it appears than at the frame's time; points are tabled, so both are tried."""
        del setting
        moving = places.moving
        either = [moving.arms(normals) for normals in (places.normal_body, _normals_before(theta[0], places))]
        appearing, still = (
            np.max([np.sum(places.normal * pixels, axis=-1) for pixels in both], axis=0)
            for both in (
                [_pixels(places, _appearing(theta[0], places, arms)) for arms in either],
                [_pixels(places, _placed(places, arms)) for arms in either],
            )
        )
        return np.asarray(appearing - still)


def _placed(places: Places, arms: Array) -> Array:
    """The points (n, k, 2, 3) m, camera axes, at the ends of ``arms`` at the frame's time."""
    return np.asarray(places.moving.centre_cam[:, None, None] + arms)


def _appearing(line_time_s: float, places: Places, arms: Array) -> Array:
    """Where (n, k, 2, 3) m those points are when their row is exposed."""
    moving = places.moving
    delay = _delay(line_time_s, places, arms)[..., None]
    turn = Rotation.from_rotvec((delay * moving.omega_cam[:, None, None]).reshape(-1, 3))
    return _placed(places, moving.v_cam[:, None, None] * delay + turn.apply(arms.reshape(-1, 3)).reshape(arms.shape))


def _normals_before(line_time_s: float, places: Places) -> Array:
    """Normals (n, k, 2, 3), body axes, at the frame's time of the planes that appear as the tangents: ``M^T n`` of the map ``M``."""
    moving = places.moving
    normals, arms = np.einsum("nij,nkmj->nkmi", moving.R_cam_body, places.normal_body), moving.arms(places.normal_body)
    turned = normals - _delay(line_time_s, places, arms)[..., None] * np.cross(moving.omega_cam[:, None, None], normals)
    along = np.sum(moving.velocity(arms) * normals, axis=-1, keepdims=True)
    return np.einsum("nij,nkmi->nkmj", moving.R_cam_body, turned + line_time_s * along * _row_slope(places, _placed(places, arms)))


def _delay(line_time_s: float, places: Places, arms: Array) -> Array:
    """When (n, k, 2) s after the frame's time the points at the ends of ``arms`` appear."""
    place = _placed(places, arms)
    row = _pixels(places, place)[..., 1] - (places.camera.height_px - 1) / 2
    return np.asarray(line_time_s * row / (1.0 - line_time_s * np.sum(_row_slope(places, place) * places.moving.velocity(arms), axis=-1)))


def _row_slope(places: Places, place: Array) -> Array:
    """Derivative (n, k, 2, 3) px/m of the row by the place, distortion left out."""
    slope = np.zeros_like(place)
    slope[..., 1], slope[..., 2] = 1.0, -place[..., 1] / place[..., 2]
    return slope * (places.camera.fy_px / place[..., 2:])


def _pixels(places: Places, place: Array) -> Array:
    return places.camera.project(place.reshape(-1, 3)).reshape(*place.shape[:-1], 2)
