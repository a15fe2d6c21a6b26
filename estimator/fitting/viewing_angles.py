"""The angle at the body between two cameras of a pair, and the pairs whose angle is too small, or too near half a turn, to be used.

A pair's epipolar direction is that of the line between its cameras; it turns by ``1 / sin(angle)`` of what the pose turns. Seen from
nearly the same side the two outlines are the same line but for noise, smoothing and the bias of hulls, and seen from opposite sides its
mirror image. So such a pair's derivative is large and made of that difference: it looks like knowledge of the orientation and is none.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import flown_in, particle_poses
from estimator.data.fit_task import FitTask
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.motion.flight import Motion

Array = NDArray[np.float64]
LEAST_SINE_WITH_VIEWS = 0.09
"""5°. On scanned bodies 0.4% of the pairs are nearer; without them the errors of 18 flights fell from 1.10 to 0.93 error bars.

10° left out useful pairs: in-plane velocity got worse by a fifth.
"""


def sines_between(first: PoseSet, second: PoseSet, centre: Array) -> Array:
    """Sines (n, k) of the angles at ``centre`` (3,) m, particle frame, between the cameras of two sets of poses."""
    return np.asarray(np.linalg.norm(np.cross(_seen_from(first, centre)[:, None], _seen_from(second, centre)[None]), axis=2))


def _seen_from(cameras: PoseSet, centre: Array) -> Array:
    away = -np.einsum("nji,nj->ni", cameras.R, cameras.t) - centre
    return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


def with_clear_angles(task: FitTask, motion: Motion) -> FitTask:
    """The task without the pairs that see the body from nearly one line under ``motion``."""
    placed = particle_poses(motion.first, flown_in(motion, task.sightings), task.sightings)
    sines = sines_between(placed, task.views.poses, motion.first.body.com_particle)
    return replace(task, weight=np.where(sines >= LEAST_SINE_WITH_VIEWS, task.weight, 0.0))
