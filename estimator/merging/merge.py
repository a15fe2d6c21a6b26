"""From sets of calibrated silhouettes to one: pairwise motions, what agrees around cycles, all sets together, what does not belong.

1. Motions of every pair of sets, from no start (:mod:`estimator.merging.set_motion`).
2. Those that close loops; the tree they span (:mod:`estimator.merging.consistency`).
3. All placements together (:mod:`estimator.merging.joint`); views that disagree with all others by several times what is usual are left
   out and the fit is made again, until none is left to leave out.
4. A set outside of the tree is searched once more, against all placed views at once; it is placed where one motion alone meets their
   tangencies and lies within their hull.

What does not belong is named with the reason and left out. The estimator sees no truth and takes no start from anybody.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.fitting.view_disagreement import disagreement, misplaced
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import silhouettes
from estimator.merging.consistency import Consensus, agree
from estimator.merging.joint import Joint, JointTask, Placements, fit_jointly
from estimator.merging.placing import placed_by_all
from estimator.merging.set_motion import MotionEffort, SetMotions, find_motions
from estimator.merging.view_set import ViewSet
from estimator.particle import view_agreement

Array = NDArray[np.float64]
MOST_ROUNDS = 4
"""Fits, each without the views that the one before has shown not to belong."""
MOSTLY = 0.5
"""A set of which a larger share of views does not belong is left out as a whole."""


@dataclass(frozen=True)
class LeftOut:
    """A set, or one view of it, that does not belong, and why."""

    name: str
    view: int | None
    reason: str


@dataclass(frozen=True)
class Merged:
    """One set of views in the frame of the first placed set.

    ``placed``: numbers of the sets, in the order of ``joint``'s placements. ``outlines``, ``views`` (n): all views used, ``set_of`` (n,) and
    ``view_of`` (n,) the set's number and the view's in it, ``view_rms_px`` (n,) RMS ETE of each against those of other sets, ``set_rms_px``
    alike of the placed sets. ``calibration_px``: by how much the rig's calibration misplaces a view.
    """

    placed: tuple[int, ...]
    joint: Joint
    outlines: tuple[Outline, ...]
    views: tuple[CalibratedView, ...]
    set_of: NDArray[np.int64]
    view_of: NDArray[np.int64]
    view_rms_px: Array
    set_rms_px: Array
    calibration_px: float
    consensus: Consensus
    left_out: tuple[LeftOut, ...]


@dataclass(frozen=True)
class MergeSettings:
    """``effort`` of the search; ``foreign_view_ratio``: times the usual disagreement from which on a view does not belong; ``floor_px``: noise that
    outlines do not show, as in :class:`estimator.configuration.Configuration`."""

    effort: MotionEffort = MotionEffort()
    foreign_view_ratio: float = 4.0
    floor_px: float = 0.04


def merge(sets: Sequence[ViewSet], settings: MergeSettings, advance: Callable[[], None] = lambda: None) -> Merged:
    """Merge sets of views of one particle; ``advance`` is called for every pair that is done.

    Raises
    ------
    InputError
        Where no two sets can be placed against each other.
    """
    every = list(sets)
    motions = _motions(every, settings.effort, advance)
    consensus = agree(every, motions)
    if len(every) > 1 and len(consensus.placed) < 2:
        raise InputError(_nothing_agrees(every, motions))
    placed, task, joint = _fitted(every, consensus.placed, consensus.placements, settings)
    reasons: dict[int, str] = {}
    for number in [n for n in range(len(every)) if n not in consensus.placed]:
        found = placed_by_all(every[number], _as_one(task, joint, every, placed), settings.effort)
        if isinstance(found, str):
            reasons[number] = found
            continue
        R, t = found
        start = Placements(np.concatenate([joint.placements.R, R[None]]), np.concatenate([joint.placements.t, t[None]]))
        placed, task, joint = _fitted(every, (*placed, number), start, settings)
    return _merged(every, (placed, task, joint), consensus, reasons)


def _motions(sets: list[ViewSet], effort: MotionEffort, advance: Callable[[], None]) -> dict[tuple[int, int], SetMotions]:
    motions = {}
    for j, i in combinations(range(len(sets)), 2):
        motions[i, j] = find_motions(sets[i], sets[j], (i, j), effort)
        advance()
    return motions


def _nothing_agrees(sets: list[ViewSet], motions: dict[tuple[int, int], SetMotions]) -> str:
    best = min((float(m.rms_px[0]) for m in motions.values() if len(m.rms_px)), default=float("inf"))
    within = max(_own(s) for s in sets)
    return (
        f"sets {', '.join(s.name for s in sets)}: expected views of one particle that agree once each set is turned as a whole, got none that "
        f"do: the best pair of sets is off by {best:.2f} px RMS, views within a set by up to {within:.2f} px. Is it one particle, and is the "
        "rig's calibration that of these pictures?"
    )


def _own(one: ViewSet) -> float:
    return disagreement(one.seen, one.poses, one.centre).rms_px


def _task(sets: list[ViewSet], placed: tuple[int, ...], settings: MergeSettings) -> JointTask:
    chosen = [sets[i] for i in placed]
    outlines, views = [o for s in chosen for o in s.outlines], [v for s in chosen for v in s.views]
    return JointTask(
        seen=misplaced(silhouettes(outlines, [v.intrinsics for v in views]), settings.floor_px),
        in_set=PoseSet(np.concatenate([s.poses.R for s in chosen]), np.concatenate([s.poses.t for s in chosen])),
        set_of=np.repeat(np.arange(len(chosen)), [len(s) for s in chosen]),
        pivot=chosen[0].centre,
        used=np.ones(len(views), dtype=np.bool_),
        huber=settings.effort.huber,
    )


def _fitted(
    sets: list[ViewSet], placed: tuple[int, ...], start: Placements, settings: MergeSettings
) -> tuple[tuple[int, ...], JointTask, Joint]:
    """The joint fit without the views that do not belong."""
    task = _task(sets, placed, settings)
    joint = fit_jointly(task, start)
    for _ in range(MOST_ROUNDS):
        poses = task.poses(joint.placements)
        _, _, foreign = view_agreement(task.seen, poses, task.pivot, settings.foreign_view_ratio)
        used = ~_with_whole_sets(foreign, task.set_of)
        if np.array_equal(used, task.used):
            break
        task = replace(task, used=used)
        joint = fit_jointly(task, joint.placements)
    return _with_calibration(placed, task, joint)


def _with_whole_sets(foreign: NDArray[np.bool_], set_of: NDArray[np.int64]) -> NDArray[np.bool_]:
    share = np.bincount(set_of, weights=foreign) / np.bincount(set_of)
    return np.asarray(foreign | (share > MOSTLY)[set_of])


def _with_calibration(placed: tuple[int, ...], task: JointTask, joint: Joint) -> tuple[tuple[int, ...], JointTask, Joint]:
    """The fit once more where views disagree by more than their outlines explain: each is misplaced by so much."""
    kept = np.flatnonzero(task.used)
    poses = task.poses(joint.placements)
    among = disagreement(task.seen.take(kept.tolist()), PoseSet(poses.R[kept], poses.t[kept]), task.pivot)
    if among.calibration_px == 0.0:
        return placed, task, joint
    task = replace(task, seen=misplaced(task.seen, among.calibration_px))
    return placed, task, fit_jointly(task, joint.placements)


def _as_one(task: JointTask, joint: Joint, sets: list[ViewSet], placed: tuple[int, ...]) -> tuple[list[Outline], list[CalibratedView]]:
    poses = task.poses(joint.placements)
    outlines, views = [o for i in placed for o in sets[i].outlines], [v for i in placed for v in sets[i].views]
    kept = np.flatnonzero(task.used)
    return [outlines[k] for k in kept], [replace(views[k], R_cam_particle=poses.R[k], t_cam_particle=poses.t[k]) for k in kept]


def _merged(
    sets: list[ViewSet], fitted: tuple[tuple[int, ...], JointTask, Joint], consensus: Consensus, reasons: dict[int, str]
) -> Merged:
    placed, task, joint = fitted
    outlines, views = _as_one(task, joint, sets, placed)
    kept = np.flatnonzero(task.used)
    view_of = np.concatenate([sets[i].numbers for i in placed])
    view_rms, set_rms = _rms(task, joint)
    among = disagreement(silhouettes(outlines, [v.intrinsics for v in views]), _poses_of(views), task.pivot)
    numbered = [replace(v, drop=placed[task.set_of[k]], camera=int(view_of[k])) for v, k in zip(views, kept, strict=True)]
    return Merged(
        placed=placed,
        joint=joint,
        outlines=tuple(outlines),
        views=tuple(numbered),
        set_of=np.array(placed)[task.set_of[kept]],
        view_of=view_of[kept],
        view_rms_px=view_rms[kept],
        set_rms_px=set_rms,
        calibration_px=among.calibration_px,
        consensus=consensus,
        left_out=_left_out(sets, placed, task, view_rms, reasons),
    )


def _poses_of(views: Sequence[CalibratedView]) -> PoseSet:
    return PoseSet(np.stack([v.R_cam_particle for v in views]), np.stack([v.t_cam_particle for v in views]))


def _rms(task: JointTask, joint: Joint) -> tuple[Array, Array]:
    """RMS ETE (px) of every view, used or not, against the used views of other sets, and of the used views of every set."""
    against = (task.set_of[:, None] != task.set_of[None, :]) & task.used[None, :]
    errors = task.errors(joint.placements, against.astype(np.float64))
    told = errors.told[:, :, :2]
    square, count = np.where(told, errors.error[:, :, :2] ** 2, 0.0).sum(axis=(1, 2)), told.sum(axis=(1, 2))
    by_set = [np.bincount(task.set_of, weights=values * task.used) for values in (square, count)]
    return np.sqrt(square / np.maximum(count, 1)), np.sqrt(by_set[0] / np.maximum(by_set[1], 1))


def _left_out(
    sets: list[ViewSet], placed: tuple[int, ...], task: JointTask, view_rms: Array, reasons: dict[int, str]
) -> tuple[LeftOut, ...]:
    typical = float(np.median(view_rms[task.used])) if task.used.any() else 0.0
    said = [LeftOut(sets[number].name, None, reason) for number, reason in reasons.items()]
    start = 0
    for number in placed:
        one = sets[number]
        rows = np.arange(start, start + len(one))
        start += len(one)
        out = rows[~task.used[rows]]
        if len(out) == len(rows):
            text = f"RMS ETE {float(np.sqrt(np.mean(view_rms[rows] ** 2))):.1f} px, the others' median {typical:.2f} px"
            said.append(LeftOut(one.name, None, text))
            continue
        said += [
            LeftOut(one.name, one.numbers[k - rows[0]], f"RMS ETE {view_rms[k]:.1f} px, the others' median {typical:.2f} px") for k in out
        ]
    return tuple(said)
