"""From one found pose to all frames: each next pose starts where constant angular velocity would take it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import Sightings
from estimator.data.views import Poses, Views
from estimator.motion.rotation import rotation_from_vector, rotation_vector
from estimator.poses.pose_refinement import refine

Array = NDArray[np.float64]
STEPS_PER_FRAME = 8
"""Of the pose's refinement from one picture to the next: the guess is near. By judgement."""


@dataclass(frozen=True)
class Track:
    """Poses in the world at increasing times.

    ``times_s`` (n,), ``R`` (n, 3, 3) world from particle, ``centre`` (n, 3) m of mass, world frame, ``cost`` (n,) per valid pair.
    """

    times_s: Array
    R: Array
    centre: Array
    cost: Array


def track(sightings: Sightings, views: Views, reference: int, found: Poses) -> Track:
    """Follow one pose (``found``, n = 1) of sighting ``reference`` through all sightings of its camera, both ways in time."""
    camera = sightings.cameras[int(sightings.camera[reference])]
    rows = np.flatnonzero(sightings.camera == sightings.camera[reference])
    rows = rows[np.argsort(sightings.times_s[rows])]
    at = int(np.flatnonzero(rows == reference)[0])
    n = len(rows)
    R, centre, cost = np.zeros((n, 3, 3)), np.zeros((n, 3)), np.full(n, np.inf)
    R[at], centre[at], cost[at] = found.R[0], found.centre_cam[0], found.cost[0]
    times = sightings.times_s[rows]
    for order in (range(at + 1, n), range(at - 1, -1, -1)):
        before = at
        spin, velocity = np.zeros(3), np.zeros(3)
        for i in order:
            dt = times[i] - times[before]
            guess = Poses(rotation_from_vector((spin * dt)[None]) @ R[before], (centre[before] + velocity * dt)[None], np.full(1, np.inf))
            pose = refine(sightings.silhouettes.take([int(rows[i])]), guess, views, iterations=STEPS_PER_FRAME, tolerance=1e-3)
            R[i], centre[i], cost[i] = pose.R[0], pose.centre_cam[0], pose.cost[0]
            spin = rotation_vector((R[i] @ R[before].T)[None])[0] / dt
            velocity = (centre[i] - centre[before]) / dt
            before = i
    R_wc = camera.R_cam_world.T
    return Track(times_s=times, R=R_wc @ R, centre=(centre - camera.t_cam_world) @ R_wc.T, cost=cost)
