"""Centroid tracking with a ballistic fit: what particle tracking does. It knows nothing of orientations.

The centroid of each outline is where the centre of mass is seen, and its area says how far away: the area of an outline, in m², is taken to
be the mean of the calibrated views' areas. A parabola under the known gravity is fitted to both. Spin is not measured: 0 ± 1000 rad/s.
"""

import sys

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from datasets.estimate import Estimate
from datasets.observation import Observation
from datasets.vocabulary.body import Body
from rivals.flight import Flight, Told, estimate_of
from rivals.joining import joined
from rivals.seen import area_and_centroid, frames_seen, outlines_of

Array = NDArray[np.float64]
UNKNOWN_SPIN = 1000.0
"""Standard deviation (rad/s) of a spin that is not measured."""


def measure(obs: Observation) -> Estimate:
    """The parabola of the centroids."""
    seen, lens, camera = frames_seen(obs), obs.cameras[0].intrinsics, obs.cameras[0]
    area, scatter = _area_of_views(obs)
    seen_at = [area_and_centroid(outline) for outline in seen.outlines]
    centres = np.array([centre for _, centre in seen_at])
    depths = lens.fx_px * np.sqrt(area / np.array([size for size, _ in seen_at]))
    t = seen.times_s[:, None]

    def misses(state: Array) -> Array:
        x = state[:3] + state[3:] * t + 0.5 * obs.gravity_world * t**2
        in_camera = x @ camera.R_cam_world.T + camera.t_cam_world
        across = (lens.project(in_camera) - centres) / wander
        return np.concatenate([across.ravel(), (in_camera[:, 2] / depths - 1) / (0.5 * scatter)])

    rough = np.column_stack([lens.normalise(centres), np.ones(len(t))]) * depths[:, None]
    world = (rough - camera.t_cam_world) @ camera.R_cam_world
    free = world - 0.5 * obs.gravity_world * t**2
    start = np.linalg.lstsq(np.hstack([np.ones_like(t), t]), free, rcond=None)[0].ravel()
    wander = 1.0
    found = least_squares(misses, start, x_scale="jac")
    wander = max(float(np.sqrt(np.mean(found.fun[: 2 * len(t)] ** 2))), 1e-3)
    found = least_squares(misses, found.x, x_scale="jac")
    jacobian: Array = np.asarray(found.jac)
    covariance = np.diag([0.0] * 6 + [np.pi**2] * 3 + [UNKNOWN_SPIN**2] * 3)
    covariance[:6, :6] = np.linalg.inv(jacobian.T @ jacobian)
    ball = Body(np.zeros(3), np.eye(3), np.ones(3))
    still = np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3)
    return estimate_of(obs, Told(Flight(found.x[:3], found.x[3:], *still), 0.0, covariance, ball, seen.rows))


def _area_of_views(obs: Observation) -> tuple[float, float]:
    """Mean area (m²) of the calibrated views, and its relative scatter."""
    areas = []
    for view, outline in zip(obs.views, outlines_of(obs.view_recording), strict=True):
        if len(outline):
            depth = view.t_cam_particle[2]
            areas.append(area_and_centroid(outline)[0] * depth**2 / (view.intrinsics.fx_px * view.intrinsics.fy_px))
    if not areas:
        raise ValueError("expected calibrated views that show the particle, got none")
    mean = float(np.mean(areas))
    return mean, max(float(np.std(areas)) / mean, 0.01)


if __name__ == "__main__":
    sys.exit(joined("centroids", measure))
