"""The pose of one silhouette from nothing: ranked starts, a coarse and a fine Levenberg-Marquardt, competing minima kept.

Silhouettes from nearly opposite directions are nearly mirror images, so a body close to mirror symmetry has antipodal minima whose errors
are hardly larger than the best one's. They are reported, not hidden: the trajectory decides between them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.data.views import Poses, Views
from estimator.geometry.silhouettes import Silhouettes
from estimator.poses.pose_refinement import pose_errors, refine
from estimator.poses.pose_starts import StartCatalogue, distinct, likely_starts

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SearchEffort:
    """Starts ranked by support function, views and steps of the coarse pass, candidates and steps of the fine pass."""

    starts: int = 48
    coarse_views: int = 15
    coarse_steps: int = 12
    candidates: int = 8
    fine_steps: int = 40
    separation_rad: float = 0.09


@dataclass(frozen=True)
class FoundPoses:
    """Distinct minima by ascending cost and ``rms_px`` (m,), the plain RMS ETE of each in the searched picture."""

    poses: Poses
    rms_px: Array


def search_pose(silhouette: Silhouettes, views: Views, catalogue: StartCatalogue, effort: SearchEffort) -> FoundPoses:
    """Distinct poses of a single silhouette (``len(silhouette) == 1``) that minimise its ETE, best first."""
    starts = likely_starts(silhouette.xy, catalogue, count=effort.starts)
    few = views.take(spread(len(views.silhouettes), effort.coarse_views))
    coarse = refine(_repeat(silhouette, len(starts.R)), starts, few, iterations=effort.coarse_steps, tolerance=1e-3)
    best = distinct(coarse, separation_rad=effort.separation_rad)
    best = best.take(np.arange(min(effort.candidates, len(best.R))))
    if len(best.R) == 0:
        return FoundPoses(best, np.zeros(0))
    fine = distinct(
        refine(_repeat(silhouette, len(best.R)), best, views, iterations=effort.fine_steps), separation_rad=effort.separation_rad
    )
    return FoundPoses(fine, pose_errors(_repeat(silhouette, len(fine.R)), fine, views).rms_of_each_px)


def spread(count: int, wanted: int) -> list[int]:
    """Numbers of at most ``wanted`` of ``count`` views, evenly spread."""
    return sorted(set(np.linspace(0, count - 1, min(wanted, count)).round().astype(int).tolist()))


def _repeat(silhouette: Silhouettes, n: int) -> Silhouettes:
    return silhouette.take([0] * n)
