"""Where the fit of a trajectory starts: position, velocity, orientation and spin at the middle row, by least squares."""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from estimator.motion.flight import Flight
from estimator.motion.rotation import quaternion, rotation_vector
from estimator.trajectories.task import TrajectoryTask

Array = NDArray[np.float64]
MOST_ROWS = 9
"""Rows about the middle whose turns are averaged: the spin of a body that is not round changes."""


def first_flight(task: TrajectoryTask, body: Body) -> Flight:
    """Free flight through a trajectory."""
    times = task.times_s
    middle = len(times) // 2
    after = times - times[middle]
    gravity = task.setting.gravity_world
    fallen = task.x_world - 0.5 * gravity * after[:, None] ** 2
    (x, v), *_ = np.linalg.lstsq(np.column_stack([np.ones_like(after), after]), fallen, rcond=None)
    return Flight(
        time_s=float(times[middle]),
        x=x,
        q=np.array([0.0, 0.0, 0.0, 1.0]) if task.R_world_body is None else quaternion(task.R_world_body[middle]),
        v=v,
        omega=_spin(task, middle),
        body=body,
        com=np.zeros(3),
        inertia=np.zeros(5),
        offset_px=0.0,
        gravity_world=gravity,
    )


def _spin(task: TrajectoryTask, middle: int) -> Array:
    """Angular velocity (3,) about the middle row."""
    if task.R_world_body is None:
        return np.zeros(3) if task.omega_world is None else np.asarray(task.omega_world.mean(axis=0))
    rows = np.arange(max(0, middle - MOST_ROWS // 2), min(len(task.times_s), middle + MOST_ROWS // 2 + 1))
    R = task.R_world_body[rows]
    turns = rotation_vector(R[1:] @ np.swapaxes(R[:-1], 1, 2))
    return np.asarray(np.median(turns / np.diff(task.times_s[rows])[:, None], axis=0))
