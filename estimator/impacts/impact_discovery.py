"""Impacts that a fit has shown to be missing, from tracked poses instead of centroids.

The centroid of a fast, irregular body runs around its centre of mass and hides weak kinks. So where flights with the impacts known so
far do not fit, each segment is tracked picture by picture from where it fits best, and the path of the centre of mass is searched for
kinks: it has none of the wobble.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import errors_of, particle_poses
from estimator.data.fit_task import FitTask, restricted
from estimator.data.views import Poses
from estimator.impacts.impact_search import LEAST_RATIO, CentroidPath, Kink, find_kinks
from estimator.motion.flight import flown
from estimator.motion.piecewise import PiecewiseFlight, segment_of
from estimator.poses.pose_refinement import refine
from estimator.search.tracking import track

Array = NDArray[np.float64]
LEAST_TRACKED = 3
"""Pictures of a segment, below which it is not tracked."""
LOST_COST = 10.0
"""A tracked pose whose cost is so many times the median has lost the body."""


def kinks_of_poses(task: FitTask, flight: PiecewiseFlight, *, least_ratio: float = LEAST_RATIO) -> list[Kink]:
    """Kinks of the tracked path of the centre of mass in the first camera that saw the particle; ``least_ratio`` of :func:`find_kinks`."""
    camera = int(task.sightings.camera[0])
    task = restricted(task, np.flatnonzero(task.sightings.camera == camera))
    segment = segment_of(flight, task.sightings.times_s)
    cost = errors_of(task, flight.first, flown(flight, task.sightings.times_s)).cost
    whole = task.sightings.silhouettes.whole
    parts = [np.flatnonzero(segment == number) for number in np.unique(segment)]
    best = [int(np.lexsort([cost[rows], ~whole[rows]])[0]) for rows in parts]
    tracked = [_tracked(restricted(task, r), flight, at) for r, at in zip(parts, best, strict=True) if len(r) >= LEAST_TRACKED]
    frame = np.concatenate([f for f, _ in tracked]) if tracked else np.zeros(0, dtype=np.int64)
    place = np.concatenate([p for _, p in tracked]) if tracked else np.zeros((0, 2))
    return find_kinks(CentroidPath(frame, place), least_ratio=least_ratio)


def _tracked(task: FitTask, flight: PiecewiseFlight, reference: int) -> tuple[NDArray[np.int64], Array]:
    """Frames (n,) of a segment and where (n, 2) px its tracked centre of mass was seen."""
    sightings = task.sightings
    one = sightings.take(np.array([reference]))
    pose = particle_poses(flight.first, flown(flight, one.times_s), one)
    guess = Poses(pose.R, pose.t + pose.R @ flight.first.body.com_particle, np.full(1, np.inf))
    found = refine(one.silhouettes, guess, task.views, iterations=20)
    followed = track(sightings, task.views, reference, found)
    camera = sightings.cameras[int(sightings.camera[reference])]
    seen = camera.intrinsics.project(followed.centre @ camera.R_cam_world.T + camera.t_cam_world)
    kept = followed.cost <= LOST_COST * np.median(followed.cost)
    return sightings.frame[np.argsort(sightings.times_s)][kept], seen[kept]
