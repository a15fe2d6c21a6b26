"""Where the fit of a trajectory starts: position, velocity, orientation and spin at the middle row, by least squares."""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from estimator.measurements.trajectories.task import TrajectoryTask
from estimator.motion.flight import Flight
from estimator.motion.rotation import quaternion, rotation_vector

Array = NDArray[np.float64]
MOST_ROWS = 9
"""Rows about the middle whose turns are averaged: the spin of a body that is not round changes."""


def first_flight(task: TrajectoryTask, body: Body) -> Flight:
    """Free flight through a trajectory."""
    times, gravity = task.times_s, task.setting.gravity_world
    middle = _middle(task)
    x, v = np.zeros(3), np.zeros(3)
    after = times - times[middle]
    for axis, seen in enumerate(task.seen("x").T):
        if seen.any():
            fallen = task.x_world[seen, axis] - 0.5 * gravity[axis] * after[seen] ** 2
            (x[axis], v[axis]), *_ = np.linalg.lstsq(np.column_stack([np.ones(seen.sum()), after[seen]]), fallen, rcond=None)
    # Without a measured attitude the world's axes are those of the tracked frame.
    R = body.R_particle_body if task.R_world_body is None else task.R_world_body[middle]
    return Flight(
        time_s=float(times[middle]),
        x=x,
        q=quaternion(R),
        v=v,
        omega=_spin(task, middle, R @ body.R_particle_body.T),
        body=body,
        com=np.zeros(3),
        inertia=np.zeros(5),
        offset_px=0.0,
        gravity_world=gravity,
    )


def _middle(task: TrajectoryTask) -> int:
    """The middle row of those with an orientation, or with all that the gyroscope ever reads, or of all."""
    for channel in ("theta", "gyro"):
        seen = task.seen(channel)
        rows = np.flatnonzero((seen == seen.any(axis=0)).all(axis=1) & seen.any())
        if len(rows):
            return int(rows[len(rows) // 2])
    return len(task.times_s) // 2


def _spin(task: TrajectoryTask, middle: int, R_world_tracked: Array) -> Array:
    """Angular velocity (3,) about the middle row, world frame."""
    if task.gyro is not None and task.seen("gyro")[middle].any():
        return np.asarray(R_world_tracked @ np.where(task.seen("gyro")[middle], task.gyro[middle], 0.0))
    if task.R_world_body is not None:
        rows = np.flatnonzero(task.seen("theta").all(axis=1))
        here = int(np.searchsorted(rows, middle))
        rows = rows[max(0, here - MOST_ROWS // 2) : here + MOST_ROWS // 2 + 1]
        turns = rotation_vector(task.R_world_body[rows[1:]] @ np.swapaxes(task.R_world_body[rows[:-1]], 1, 2))
        return np.asarray(np.median(turns / np.diff(task.times_s[rows])[:, None], axis=0))
    if task.omega_world is None:
        return np.zeros(3)
    seen = task.seen("omega")
    return np.asarray(np.where(seen, task.omega_world, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1))
