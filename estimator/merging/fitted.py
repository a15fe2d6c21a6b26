"""Sets fitted jointly, without the views that do not belong, and with what the rig's calibration leaves.

A view does not belong where it disagrees with all others several times as much as is usual
(:func:`estimator.particle.particle.view_agreement`); the fit is made again without it, until none is left to leave out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import silhouettes
from estimator.merging.joint import Joint, JointTask, Placements, fit_jointly
from estimator.merging.rig_errors import rig_errors
from estimator.merging.set_motion import MotionEffort
from estimator.merging.view_set import ViewSet
from estimator.particle.particle import view_agreement
from estimator.particle.view_disagreement import Disagreement, disagreement, misplaced

MOST_ROUNDS = 4
"""Fits, each without the views that the one before has shown not to belong."""
MOSTLY = 0.5
"""A set of which a larger share of views does not belong is left out as a whole."""


@dataclass(frozen=True)
class MergeSettings:
    """The search's ``effort``; ``foreign_view_ratio`` and ``floor_px`` as in :class:`estimator.data.configuration.Configuration`.

    A view does not belong from ``foreign_view_ratio`` times the usual disagreement on; ``floor_px`` is noise that outlines do not show.
    """

    effort: MotionEffort = field(default_factory=MotionEffort)
    foreign_view_ratio: float = Configuration.foreign_view_ratio
    floor_px: float = Configuration.floor_px


@dataclass(frozen=True)
class Fitted:
    """Sets fitted jointly: the ``sets``, the task with the views that belong, and its result."""

    sets: tuple[ViewSet, ...]
    task: JointTask
    joint: Joint

    @property
    def kept(self) -> NDArray[np.int64]:
        """Numbers of the views that belong."""
        return np.flatnonzero(self.task.used)

    @property
    def as_one(self) -> tuple[list[Outline], list[CalibratedView]]:
        """Outlines and views that belong, in the particle's frame."""
        poses = self.task.poses(self.joint.placements)
        outlines, views = [o for s in self.sets for o in s.outlines], [v for s in self.sets for v in s.views]
        return [outlines[k] for k in self.kept], [
            replace(views[k], R_cam_particle=poses.R[k], t_cam_particle=poses.t[k]) for k in self.kept
        ]

    @property
    def among(self) -> Disagreement:
        """How the views that belong agree."""
        poses = self.task.poses(self.joint.placements)
        return disagreement(self.task.seen.take(self.kept.tolist()), PoseSet(poses.R[self.kept], poses.t[self.kept]), self.task.pivot)


def fit_sets(sets: Sequence[ViewSet], start: Placements, settings: MergeSettings) -> Fitted:
    """The joint fit of sets from ``start``, without the views that do not belong; a set may have none left."""
    fitted = _belonging(sets, start, settings)
    whole = np.bincount(fitted.task.set_of, weights=fitted.task.used) > 0
    return _with_calibration(fitted) if whole.all() else fitted


def _belonging(sets: Sequence[ViewSet], start: Placements, settings: MergeSettings) -> Fitted:
    fitted = _first_fit(sets, start, settings)
    for _ in range(MOST_ROUNDS):
        poses = fitted.task.poses(fitted.joint.placements)
        _, foreign = view_agreement(fitted.task.seen, poses, fitted.task.pivot, settings.foreign_view_ratio)
        used = ~_with_whole_sets(foreign, fitted.task.set_of)
        whole = np.bincount(fitted.task.set_of, weights=used) > 0
        if np.array_equal(used, fitted.task.used) or not whole.all():
            return replace(fitted, task=replace(fitted.task, used=used))
        fitted = _again(replace(fitted.task, used=used), fitted)
    return fitted


def _with_calibration(fitted: Fitted) -> Fitted:
    """Once more where the views disagree by more than their outlines explain: with the rig's own errors, where enough sets share it.

    By what disagreement is left each view is misplaced, which the covariance contains.
    """
    before = fitted.among.calibration_px
    if before == 0.0:
        return fitted
    rig = rig_errors(fitted.sets, fitted.task, fitted.joint.placements, before)
    if rig is not None:
        better = _again(replace(fitted.task, rig=rig), fitted)
        if better.among.calibration_px < before:
            fitted = better
    left = fitted.among.calibration_px
    return fitted if left == 0.0 else _again(replace(fitted.task, seen=misplaced(fitted.task.seen, left)), fitted)


def _first_fit(sets: Sequence[ViewSet], start: Placements, settings: MergeSettings) -> Fitted:
    outlines, views = [o for s in sets for o in s.outlines], [v for s in sets for v in s.views]
    task = JointTask(
        seen=misplaced(silhouettes(outlines, [v.intrinsics for v in views]), settings.floor_px),
        in_set=PoseSet(np.concatenate([s.poses.R for s in sets]), np.concatenate([s.poses.t for s in sets])),
        set_of=np.repeat(np.arange(len(sets)), [len(s) for s in sets]),
        pivot=start.R[0].T @ (sets[0].centre - start.t[0]),
        used=np.ones(len(views), dtype=np.bool_),
        huber=settings.effort.huber,
    )
    return Fitted(tuple(sets), task, fit_jointly(task, start))


def _again(task: JointTask, fitted: Fitted) -> Fitted:
    return replace(fitted, task=task, joint=fit_jointly(task, fitted.joint.placements))


def _with_whole_sets(foreign: NDArray[np.bool_], set_of: NDArray[np.int64]) -> NDArray[np.bool_]:
    share = np.bincount(set_of, weights=foreign) / np.bincount(set_of)
    return np.asarray(foreign | (share > MOSTLY)[set_of])
