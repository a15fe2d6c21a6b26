"""The rigid motion between two sets of views of one particle, by epipolar tangency.

Every view of the first set with every view of the second: k m pairs give 4 k m distances for six unknowns, so that the right motion
stands out where a single view's pose would be ambiguous [Forbes, Nicolls, de Jager and Voigt 2006]. Starts are spread evenly over all
rotations and ranked by their cost; translation starts where the centres of the two sets' hulls meet. The best are refined together
(:func:`estimator.poses.pose_refinement.descend`), distinct minima are kept.

Not valid for bodies whose outlines are the same from directions that a symmetry maps to one another: every such motion costs the same, and
all are returned.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.data.views import Poses, Views
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.silhouettes import Silhouettes
from estimator.merging.even_rotations import even_rotations
from estimator.merging.view_set import MINIMUM_VIEWS, ViewSet
from estimator.poses.pose_refinement import MINIMUM_VALID_SHARE, Equations, descend
from estimator.poses.pose_search import spread
from estimator.poses.pose_starts import distinct, likely_starts, start_catalogue

Array = NDArray[np.float64]
AT_ONCE = 256
"""Motions whose errors are computed together, to bound memory."""


FEW_STARTS, FEW_FINE = 200, 24
"""Starts and candidates where one or two views are placed, as for single pictures with few views
(:mod:`estimator.measuring.free_flight`)."""


@dataclass(frozen=True)
class MotionEffort:
    """Starts over all rotations (2000: the nearest is 15° off at most), those refined coarsely, and finely; steps of either.

    Starts are ranked and coarsely refined against ``coarse_views`` of the second set at most.
    """

    starts: int = 2000
    coarse_views: int = 12
    coarse: int = 64
    coarse_steps: int = 12
    fine: int = 8
    fine_steps: int = 40
    separation_rad: float = 0.09
    huber: float = 4.0


@dataclass(frozen=True)
class SetMotions:
    """Distinct motions from set ``second`` to set ``first``, best first.

    ``poses``: ``R`` (n, 3, 3) turns the second's axes into the first's, ``centre_cam`` (n, 3) m is where the second's centre lies in the
    first's frame, ``cost`` per valid pair. ``rms_px`` (n,): see :func:`motion_rms_px`.
    """

    first: int
    second: int
    poses: Poses
    rms_px: Array


def find_motions(first: ViewSet, second: ViewSet, numbers: tuple[int, int], effort: MotionEffort) -> SetMotions:
    """Distinct motions that meet the tangencies of all pairs of views of two sets, from no start at all."""
    R = even_rotations(effort.starts)
    starts = Poses(R, np.broadcast_to(first.centre, (len(R), 3)).copy(), np.zeros(len(R)))
    every = second.as_views
    few = every.take(spread(len(second), effort.coarse_views))
    costs = np.concatenate([_equations(first, few, part, effort.huber).cost for part in _parts(starts)])
    ranked = Poses(starts.R, starts.centre_cam, costs).take(np.argsort(costs)[: effort.coarse])
    coarse = _refined(first, few, ranked, steps=effort.coarse_steps, huber=effort.huber)
    best = distinct(coarse, separation_rad=effort.separation_rad)
    best = best.take(np.arange(min(effort.fine, len(best.R))))
    fine = distinct(_refined(first, every, best, steps=effort.fine_steps, huber=effort.huber), separation_rad=effort.separation_rad)
    return SetMotions(*numbers, fine, motion_rms_px(first, every, fine))


def motions_of_few(few: ViewSet, placed: ViewSet, effort: MotionEffort) -> SetMotions:
    """The same for one or two views, whose middle is not known: starts are those of the first view alone, by its support function."""
    catalogue = start_catalogue(placed.hull.vertices, placed.centre)
    alone = likely_starts(few.seen.xy[few.seen.slice_of(0)], catalogue, count=FEW_STARTS)
    back = few.poses.R[0].T
    starts = Poses(back @ alone.R, (alone.centre_cam - few.poses.t[0]) @ back.T, alone.cost)
    every = placed.as_views
    coarse = _refined(few, every.take(spread(len(placed), effort.coarse_views)), starts, steps=effort.coarse_steps, huber=effort.huber)
    best = distinct(coarse, separation_rad=effort.separation_rad)
    best = best.take(np.arange(min(FEW_FINE, len(best.R))))
    fine = distinct(_refined(few, every, best, steps=effort.fine_steps, huber=effort.huber), separation_rad=effort.separation_rad)
    return SetMotions(0, 1, fine, motion_rms_px(few, every, fine))


def _refined(first: ViewSet, second: Views, starts: Poses, *, steps: int, huber: float) -> Poses:
    """The motions after at most ``steps`` damped steps from ``starts``."""
    if len(starts.R) == 0:
        return starts
    return descend(lambda trial, _: _equations(first, second, trial, huber), starts, iterations=steps)


def motion_errors(first: ViewSet, second: Views, motions: Poses, *, huber: float = np.inf) -> TangencyErrors:
    """Errors of the k views of ``first`` with those of ``second`` under n motions: entry ``i k + c`` is of motion ``i``, view ``c``."""
    R_first, t_first = first.poses.R, first.poses.t
    R = (R_first[None] @ motions.R[:, None]).reshape(-1, 3, 3)
    centre = (motions.centre_cam @ R_first.transpose(0, 2, 1)).transpose(1, 0, 2) + t_first
    t = centre.reshape(-1, 3) - R @ second.centre
    axes = np.ascontiguousarray(np.broadcast_to(R_first, (len(motions.R), *R_first.shape)).reshape(-1, 3, 3))
    return tangency_errors(
        _repeated(first.seen, len(motions.R)),
        PoseSet(np.ascontiguousarray(R), np.ascontiguousarray(t)),
        second.silhouettes,
        second.poses,
        pivot_particle=second.centre,
        axes=axes,
        huber=huber,
    )


def motion_rms_px(first: ViewSet, second: Views, motions: Poses) -> Array:
    """RMS (n,) px of the errors in the first's pictures, without the worst view of either set that has more than three.

    A single view that does not belong is left out later, by name; it must not refuse the motion of its set.
    """
    if len(motions.R) == 0:
        return np.zeros(0)
    errors = motion_errors(first, second, motions)
    told = errors.told[:, :, :2]
    shape = (len(motions.R), len(first), len(second.silhouettes))
    square = np.where(told, errors.error[:, :, :2] ** 2, 0.0).sum(axis=2).reshape(shape)
    return np.array([rms_without_worst(s, c) for s, c in zip(square, told.sum(axis=2).reshape(shape), strict=True)])


def rms_without_worst(square: Array, count: NDArray[np.int64]) -> float:
    """RMS of errors without the worst row and column of more than three; ``square``, ``count`` (n, k) their sums and numbers."""
    for axis in (1, 0):
        if square.shape[1 - axis] > MINIMUM_VIEWS:
            worst = int(np.argmax(square.sum(axis=axis) / np.maximum(count.sum(axis=axis), 1)))
            square, count = np.delete(square, worst, axis=1 - axis), np.delete(count, worst, axis=1 - axis)
    return float(np.sqrt(square.sum() / max(int(count.sum()), 1)))


def _equations(first: ViewSet, second: Views, motions: Poses, huber: float) -> Equations:
    n, k = len(motions.R), len(first)
    errors = motion_errors(first, second, motions, huber=huber)
    valid = errors.valid.reshape(n, -1)
    count = valid.sum(axis=1)
    cost = errors.cost.reshape(n, k).sum(axis=1) / np.maximum(count, 1)
    enough = count >= max(2, MINIMUM_VALID_SHARE * valid.shape[1])
    return Equations(
        cost=np.where(enough, cost, np.inf),
        normal=errors.normal.reshape(n, k, 8, 8).sum(axis=1)[:, :6, :6],
        gradient=errors.gradient.reshape(n, k, 8).sum(axis=1)[:, :6],
    )


def _repeated(seen: Silhouettes, n: int) -> Silhouettes:
    return seen.take(list(range(len(seen))) * n)


def _parts(poses: Poses) -> list[Poses]:
    return [poses.take(np.arange(i, min(i + AT_ONCE, len(poses.R)))) for i in range(0, len(poses.R), AT_ONCE)]
