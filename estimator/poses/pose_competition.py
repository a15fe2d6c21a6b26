"""Which minima of a pose search can stand beside each other, and whether one stands alone.

Tangency uses two numbers per calibrated view, so ``k`` views leave ``2k - 6`` degrees of freedom: with five views a wrong pose can meet
all ten by chance, better than the right one meets them through the calibration's errors. Two tests that need no truth:

- *tangency*: a minimum is refused when its sum of squares exceeds the 95% quantile of chi² with ``2k - 6`` degrees of freedom, at the
  noise that the calibrated views show among themselves, or at the best minimum's own where that is larger;
- *containment*: a body lies inside its visual hull [Laurentini 1994], so its outline lies inside the hull's image. This uses the whole
  outline, and is what decides where views are few. With many views the hull fits the body and tangency decides before it.

Containment says nothing where outlines are cut, and less the fatter the hull. More than one minimum left is ``ambiguous``, none is
``no convergence``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.special import chdtri

from datasets.estimate import Status
from estimator.data.views import Poses, Views
from estimator.geometry.silhouettes import Silhouettes
from estimator.poses.pose_refinement import pose_errors
from estimator.poses.pose_search import FoundPoses

Array = NDArray[np.float64]
CONFIDENCE = 0.95
"""Probability with which the right pose's error stays below what rules others out."""
PROTRUSION_SIGMAS = 4.0
"""Noises by which a hull may stand out of an outline beyond what it does in its own views. By judgement."""


@dataclass(frozen=True)
class Competition:
    """The minima that stand, ``rows`` (m,) of the search's result, best first, and what they make of its status.

    ``protrusion_px`` (n,): how far the outline reaches out of the hull's image at every minimum (negative: inside it by so much);
    ``allowed_px`` of it and ``allowed_rms_px`` of the RMS ETE are the limits applied.
    """

    status: Status
    rows: NDArray[np.int64]
    protrusion_px: Array
    allowed_px: float
    allowed_rms_px: float


def compete(found: FoundPoses, silhouette: Silhouettes, views: Views, hull_points: Array, *, noise_px: float) -> Competition:
    """Test every minimum of one silhouette.

    ``hull_points`` (v, 3) m, particle frame: vertices of the visual hull of ``views``; ``noise_px``: RMS ETE of the views among themselves.
    """
    n = len(found.rms_px)
    protrusion = protrusion_px(silhouette.take([0] * n), found.poses, hull_points - views.centre)
    allowed = PROTRUSION_SIGMAS * noise_px + max(float(np.max(own_protrusion_px(views, hull_points))), 0.0)
    contained = np.flatnonzero(protrusion <= allowed)
    if len(contained) == 0:
        return Competition(Status.NO_CONVERGENCE, contained, protrusion, allowed, 0.0)
    best = found.poses.take(contained[:1])
    pairs = int(pose_errors(silhouette, best, views).valid.sum())
    limit = rms_limit_px(float(found.rms_px[contained[0]]), noise_px, pairs)
    rows = contained[found.rms_px[contained] <= limit]
    return Competition(Status.CONVERGED if len(rows) == 1 else Status.AMBIGUOUS, rows, protrusion, allowed, limit)


def rms_limit_px(best_rms_px: float, noise_px: float, pairs: int) -> float:
    """Largest RMS ETE (px) that ``pairs`` views do not refuse.

    The residuals of a fit with six parameters are smaller than the noise by ``sqrt((2k - 6) / 2k)``; three views leave none to refuse by.
    """
    numbers, free = 2 * pairs, 2 * pairs - 6
    if free <= 0:
        return float("inf")
    noise = max(noise_px, best_rms_px * np.sqrt(numbers / free))
    return float(noise * np.sqrt(chdtri(free, 1.0 - CONFIDENCE) / numbers))


def own_protrusion_px(views: Views, hull_points: Array) -> Array:
    """Protrusion (px) of each calibrated view's own outline at its given pose: what noise, calibration and voxels make of a right one.

    ``hull_points`` (v, 3) m, particle frame.
    """
    centre_cam = views.poses.R @ views.centre + views.poses.t
    given = Poses(views.poses.R, centre_cam, np.zeros(len(centre_cam)))
    return protrusion_px(views.silhouettes, given, hull_points - views.centre)


def protrusion_px(silhouettes: Silhouettes, poses: Poses, hull_from_centre: Array) -> Array:
    """How far (px) each silhouette's convex hull reaches out of the image of the body's hull at the pose of the same number.

    ``hull_from_centre`` (v, 3) m.
    """
    points = hull_from_centre[ConvexHull(hull_from_centre).vertices]
    return np.array([_outside_px(silhouettes, i, points @ poses.R[i].T + poses.centre_cam[i]) for i in range(len(silhouettes))])


def _outside_px(silhouettes: Silhouettes, index: int, points_cam: Array) -> float:
    focal = silhouettes.focal_px[index]
    edges = ConvexHull(points_cam[:, :2] / points_cam[:, 2:] * focal).equations
    seen = silhouettes.xy[silhouettes.slice_of(index)] * focal
    return float((seen @ edges[:, :2].T + edges[:, 2]).max())
