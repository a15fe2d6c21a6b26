"""A set placed against all views that are placed already: one search, and whether its result stands.

With many views the tangencies alone refuse a wrong pose. As for single pictures (:mod:`estimator.poses.pose_competition`) a motion stands
where its error is one that noise and calibration make, and where the set's outlines lie within the image of the others' hull.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.data.views import Poses
from estimator.geometry.epipolar_tangency import tangency_errors
from estimator.merging.set_motion import MotionEffort, SetMotions, find_motions, motions_of_few
from estimator.merging.view_set import MINIMUM_VIEWS, ViewSet, view_set
from estimator.particle.view_disagreement import UNEXPLAINED_PX
from estimator.poses.pose_competition import PROTRUSION_SIGMAS, own_protrusion_px, protrusion_px, rms_limit_px

Array = NDArray[np.float64]
OTHERS = "all placed views"


def placed_by_all(
    one: ViewSet, others: tuple[Sequence[Outline], Sequence[CalibratedView]], effort: MotionEffort
) -> tuple[Array, Array] | str:
    """``R``, ``t`` (m) from the particle's frame to the set's, or in words why there is none."""
    placed = view_set(OTHERS, *others)
    found = motions_of_few(one, placed, effort) if one.is_small else find_motions(one, placed, (0, 1), effort)
    standing, said = stands(one, placed, found)
    if len(standing) == 0:
        return f"no placement meets the other sets: {said}"
    if len(standing) > 1:
        return f"{len(standing)} placements meet the other sets equally well ({said}): more views would decide"
    R = found.poses.R[standing[0]]
    return R, found.poses.centre_cam[standing[0]] - R @ placed.centre


def stands(one: ViewSet, placed: ViewSet, found: SetMotions) -> tuple[NDArray[np.int64], str]:
    """Numbers of the motions that fit and that the best of them does not refuse, best first, and in words what they were judged by."""
    fit, said = fitting(one, placed, found)
    if len(fit) == 0:
        return fit, said
    limit = rms_limit_px(float(found.rms_px[fit[0]]), _noise_of(one, placed), len(one) * len(placed))
    return fit[found.rms_px[fit] <= limit], said


def fitting(one: ViewSet, placed: ViewSet, found: SetMotions) -> tuple[NDArray[np.int64], str]:
    """Numbers of the motions whose errors and protrusion are what noise and calibration make, and in words what was asked."""
    if len(found.rms_px) == 0:
        return np.zeros(0, dtype=np.int64), "no start of the search converged"
    most = PROTRUSION_SIGMAS * _noise_of(one, placed)
    allowed = most + max(float(np.max(own_protrusion_px(placed.as_views, placed.hull.vertices))), 0.0)
    low = np.flatnonzero(found.rms_px <= most)
    reach = {n: outside_px(one, placed, found.poses.take(np.array([n]))) for n in {0, *low.tolist()}}
    said = f"RMS ETE {found.rms_px[0]:.2f} px ({most:.2f} px at most), {reach[0]:.1f} px out of their hull ({allowed:.1f} px at most)"
    return np.array([n for n in low.tolist() if reach[n] <= allowed], dtype=np.int64), said


def _noise_of(one: ViewSet, placed: ViewSet) -> float:
    return max(_noise_px(one), _noise_px(placed))


def _noise_px(views: ViewSet) -> float:
    """RMS (px) of the views among themselves, without the worst of more than three, or what outlines explain where that is more."""
    k = len(views)
    errors = tangency_errors(views.seen, views.poses, views.seen, views.poses, pivot_particle=views.centre, weight=1.0 - np.eye(k))
    told = errors.told[:, :, :2]
    square, expected = (np.where(told, values, 0.0).sum(axis=2) for values in (errors.error[:, :, :2] ** 2, errors.variance[:, :, :2]))
    if k > MINIMUM_VIEWS:
        kept = np.delete(np.arange(k), int(np.argmax(square.sum(axis=1))))
        square, expected, told = square[np.ix_(kept, kept)], expected[np.ix_(kept, kept)], told[np.ix_(kept, kept)]
    count = max(int(told.sum()), 1)
    return float(np.sqrt(max(square.sum(), expected.sum()) / count + UNEXPLAINED_PX**2))


def outside_px(one: ViewSet, placed: ViewSet, motion: Poses) -> float:
    """How far (px) outlines of ``one`` reach out of the image of the other's hull under one motion; negative: inside by so much.

    The farthest of all views but one where there are more than three: a single view that does not belong is left out later, by name.
    """
    R = one.poses.R @ motion.R[0]
    centre = one.poses.R @ motion.centre_cam[0] + one.poses.t
    reach = np.sort(protrusion_px(one.seen, Poses(R, centre, np.zeros(len(one))), placed.hull.vertices - placed.centre))
    return float(reach[-1 if len(reach) <= MINIMUM_VIEWS else -2])
