"""Render and compare: one flight whose silhouettes overlap the recorded ones best (intersection over union), by a generic optimiser.

Convex hulls of outlines stand for both, so that their overlap is exact. Nelder and Mead's simplex moves position, velocity, rotation and
angular velocity at the middle; it begins at the smoothed poses of :mod:`rivals.pose_by_pose`. It has no covariance to tell: what it tells
is the change that costs as much as the best flight misses, taken for each of the twelve numbers alone.
"""

import sys
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate
from datasets.observation import Observation
from rivals.flight import Flight, Told, estimate_of, motion_of
from rivals.hull import Hull, hull_of
from rivals.joining import joined
from rivals.pose_by_pose import poses_of, smoothed
from rivals.seen import Seen, frames_seen

Array = NDArray[np.float64]
FRAMES = 25
"""Compared at most, spread evenly."""
CALLS = 4000
STEPS = np.array([2e-5, 2e-5, 2e-3, 2e-3, 2e-3, 0.2, 0.02, 0.02, 0.02, 1.0, 1.0, 1.0])
"""Of the first simplex: m, m/s, rad and rad/s."""


def measure(obs: Observation) -> Estimate:
    """The flight of the best overlap."""
    hull, seen = hull_of(obs), frames_seen(obs)
    at_s, start, _ = smoothed(poses_of(obs, hull, seen), seen.times_s, obs.gravity_world)
    rows = np.unique(np.linspace(0, len(seen.rows) - 1, FRAMES).astype(int))
    missed = _Overlap(obs, hull, seen, rows, (at_s, start))
    simplex = np.vstack([np.zeros(12), np.eye(12)])
    options: Any = {"maxfev": CALLS, "initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-8, "adaptive": True}
    found = minimize(missed, np.zeros(12), method="Nelder-Mead", options=options)
    covariance = np.diag([(_reach(missed, found.x, k) * STEPS[k]) ** 2 for k in range(12)])
    return estimate_of(obs, Told(start.moved(found.x * STEPS), at_s, covariance, hull.body, seen.rows[rows]))


class _Overlap:
    """One minus the mean intersection over union of a flight near a start, the flight from an instant (s) on."""

    def __init__(self, obs: Observation, hull: Hull, seen: Seen, rows: NDArray[np.int64], start: tuple[float, Flight]) -> None:
        self.obs, self.hull, self.start = obs, hull, start[1]
        self.times = seen.times_s[rows] - start[0]
        self.outlines = [_convex(seen.outlines[k]) for k in rows]
        self.corners = hull.corners

    def __call__(self, step: Array) -> float:
        motion = motion_of(self.start.moved(step * STEPS), self.times, self.hull.body, self.obs.gravity_world)
        camera = self.obs.cameras[0]
        total = 0.0
        for k, seen in enumerate(self.outlines):
            world = Rotation.from_quat(motion.q_world_body[k]).apply(self.corners) + motion.x_world[k]
            cast = _convex(camera.intrinsics.project(world @ camera.R_cam_world.T + camera.t_cam_world))
            total += _overlap(seen, cast)
        return 1.0 - total / len(self.outlines)


def _convex(points: Array) -> NDArray[np.float32]:
    found: NDArray[np.float32] = cv2.convexHull(points.astype(np.float32))
    return found


def _overlap(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    middle = one.mean(axis=0)  # float32 has 1e-4 px left near the middle of a picture
    both, _ = cv2.intersectConvexConvex(one - middle, other - middle)
    return both / (cv2.contourArea(one) + cv2.contourArea(other) - both)


def _reach(missed: _Overlap, best: Array, k: int) -> float:
    """By how many steps of number ``k`` the best flight's miss doubles, if it grows as a square does."""
    least = missed(best)
    grown = [missed(best + sign * np.eye(12)[k]) - least for sign in (-1.0, 1.0)]
    return float(np.sqrt(least / max(sum(grown) / 2, 1e-9)))


if __name__ == "__main__":
    sys.exit(joined("silhouette_iou", measure))
