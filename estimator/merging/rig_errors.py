"""What may be off of a rig's calibration, to be fitted along with the placements of the sets.

A camera's error is the same in all sets, the particle's placement is another in each: with three sets and more the two are told apart. The
prior is as wide as the views disagree: each number may move the outline by ``calibration_px`` where it is farthest from the middle.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView
from estimator.merging.joint import JointTask, Placements, RigErrors
from estimator.merging.view_set import ViewSet

Array = NDArray[np.float64]
LEAST_SETS = 3
"""Sets that have to share a camera: of two sets, one error for each is as good as one for the camera."""
SAME = 1e-9
"""Rounding between poses (rad, m) of one camera."""


def rig_errors(sets: Sequence[ViewSet], task: JointTask, at: Placements, calibration_px: float) -> RigErrors | None:
    """The cameras that enough sets share, with their priors; none where there are none. A camera is the same where its calibration is."""
    camera_of = _cameras([view for one in sets for view in one.views])
    shared = [c for c in range(int(camera_of.max()) + 1) if np.count_nonzero(camera_of == c) >= LEAST_SETS]
    if not shared:
        return None
    camera_of = np.array([shared.index(c) if c in shared else -1 for c in camera_of.tolist()])
    poses = task.poses(at)
    centre = poses.R @ task.pivot + poses.t
    pivot = np.array([centre[camera_of == c].mean(axis=0) for c in range(len(shared))])
    focal = np.array([task.seen.focal_px[np.argmax(camera_of == c), 0] for c in range(len(shared))])
    moved = calibration_px * pivot[:, 2] / focal
    radius = 0.5 * float(np.nanmedian([one.extent_m for one in sets]))
    return RigErrors(camera_of, pivot, np.repeat(np.column_stack([moved, moved / radius]), 3, axis=1))


def _cameras(views: Sequence[CalibratedView]) -> NDArray[np.int64]:
    """Which camera each view is of, numbered as they come."""
    known: list[CalibratedView] = []
    numbers = []
    for view in views:
        same = [c for c, other in enumerate(known) if _same(view, other)]
        if not same:
            known.append(view)
        numbers.append(same[0] if same else len(known) - 1)
    return np.array(numbers, dtype=np.int64)


def _same(a: CalibratedView, b: CalibratedView) -> bool:
    apart = max(float(np.abs(a.R_cam_particle - b.R_cam_particle).max()), float(np.abs(a.t_cam_particle - b.t_cam_particle).max()))
    return a.intrinsics == b.intrinsics and apart <= SAME
