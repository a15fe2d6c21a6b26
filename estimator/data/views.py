"""Calibrated views as fits use them, and candidate poses of one picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import Silhouettes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Views:
    """The calibrated views as the fits use them: silhouettes, poses and ``centre`` (3,) m, particle frame, that rotations keep."""

    silhouettes: Silhouettes
    poses: PoseSet
    centre: Array

    def take(self, indices: "list[int]") -> "Views":
        """The views ``indices`` alone."""
        return Views(self.silhouettes.take(indices), PoseSet(self.poses.R[indices].copy(), self.poses.t[indices].copy()), self.centre)


@dataclass(frozen=True)
class Poses:
    """n candidate poses.

    ``R`` (n, 3, 3) from particle to camera axes, ``centre_cam`` (n, 3) m where the centre of mass lies, ``cost`` (n,) per valid pair.
    """

    R: Array
    centre_cam: Array
    cost: Array

    def take(self, rows: NDArray[np.int64]) -> "Poses":
        """The candidates ``rows`` (k,) alone."""
        return Poses(self.R[rows], self.centre_cam[rows], self.cost[rows])
