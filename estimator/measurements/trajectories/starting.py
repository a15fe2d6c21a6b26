"""Where the fit of a trajectory starts: position, velocity, orientation and spin at the middle row, by least squares."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.vocabulary.body import Body
from estimator.measurements.trajectories.task import TrajectoryTask
from estimator.motion.flight import Flight
from estimator.motion.rotation import quaternion, rotation_vector

Array = NDArray[np.float64]
MOST_ROWS = 9
"""Rows about the middle whose turns are averaged: the spin of a body that is not round changes."""

NO_SLOPE = 1e-12
"""Against division by zero (1/s²): a ball's readings do not tell what is not read."""


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
    R = body.R_particle_body if task.R_world_body is None else _turning(task.R_world_body, task, middle)[0]
    return Flight(
        time_s=float(times[middle]),
        x=x,
        q=quaternion(R),
        v=v,
        omega=_spin(task, middle, R @ body.R_particle_body.T, body),
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


def _spin(task: TrajectoryTask, middle: int, R_world_tracked: Array, body: Body) -> Array:
    """Angular velocity (3,) about the middle row, world frame."""
    if task.gyro is not None and task.seen("gyro")[middle].any():
        return np.asarray(R_world_tracked @ (np.where(task.seen("gyro")[middle], task.gyro[middle], 0.0) + _never_read(task, body)))
    if task.R_world_body is not None:
        return _turning(task.R_world_body, task, middle)[1]
    if task.omega_world is None:
        return np.zeros(3)
    seen = task.seen("omega")
    return np.asarray(np.where(seen, task.omega_world, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1))


def _about(task: TrajectoryTask, middle: int) -> NDArray[np.int64]:
    """Rows with an orientation about the middle one."""
    rows = np.flatnonzero(task.seen("theta").all(axis=1))
    here = int(np.searchsorted(rows, middle))
    return rows[max(0, here - MOST_ROWS // 2) : here + MOST_ROWS // 2 + 1]


def _turning(R: Array, task: TrajectoryTask, middle: int) -> tuple[Array, Array]:
    """Attitude (3, 3), world from body, of the middle row and spin (3,) rad/s, world frame, with which most rows about it agree.

    Attitudes ``R`` (n, 3, 3), world from body, may be flipped ones: each row's is tried, with each turn to the next one and the usual turn.
    """
    rows = _about(task, middle)
    times = task.times_s[rows]
    turns = rotation_vector(R[rows[1:]] @ np.swapaxes(R[rows[:-1]], 1, 2)) / np.diff(times)[:, None]
    spins = np.vstack([np.median(turns, axis=0), turns])
    back = Rotation.from_rotvec(((task.times_s[middle] - times)[:, None] * spins[:, None]).reshape(-1, 3)).as_matrix()
    there = back.reshape(len(spins), len(rows), 3, 3) @ R[rows]
    apart = np.median(np.linalg.norm(there[:, :, None] - there[:, None], axis=(3, 4)), axis=2)
    spin, row = np.unravel_index(np.argmin(apart), apart.shape)
    return there[spin, row], spins[spin]


def _never_read(task: TrajectoryTask, body: Body) -> Array:
    """What of the spin (3,) rad/s, tracked frame, a gyroscope never reads though the other two axes tell it: none for a ball.

    By Euler's equations ``I dw/dt = -w x I w`` the readings change at a rate that is linear in a constant spin ``s`` about the axis ``e``
    that is not read, but for ``s²``, which adds the same in every row, as a bias does. So ``s`` is the slope of the rates less their mean.
    """
    seen = task.seen("gyro")
    axes = seen.any(axis=0)
    rows = np.flatnonzero((seen[1:] & seen[:-1])[:, axes].all(axis=1))
    if task.gyro is None or axes.sum() != 2 or not len(rows):
        return np.zeros(3)
    e = np.where(axes, 0.0, 1.0)
    moments = body.R_particle_body @ np.diag(body.inertia_ratios) @ body.R_particle_body.T
    w = np.where(axes, 0.5 * (task.gyro[rows + 1] + task.gyro[rows]), 0.0)
    slowed = -np.cross(w, w @ moments) @ np.linalg.inv(moments)
    slope = -(np.cross(w, moments @ e) + np.cross(e, w @ moments)) @ np.linalg.inv(moments)
    rate = (task.gyro[rows + 1] - task.gyro[rows]) / (task.times_s[rows + 1] - task.times_s[rows])[:, None] - slowed
    slope, rate = ((each - each.mean(axis=0))[:, axes] for each in (slope, rate))
    return np.asarray(e * np.sum(slope * rate) / max(float(np.sum(slope**2)), NO_SLOPE))
