"""From sets of calibrated silhouettes to one: pairwise motions, what agrees around cycles, all sets together, what does not belong.

1. Motions of every pair of sets, from no start (:mod:`estimator.merging.set_motion`).
2. Those that close loops; the tree they span (:mod:`estimator.merging.consistency`).
3. All placements together (:mod:`estimator.merging.joint`); views that disagree with all others by several times what is usual are left
   out and the fit is made again, until none is left to leave out.
4. A set outside of the tree is searched once more, against all placed views at once; it is placed where one motion alone meets their
   tangencies and lies within their hull.

What does not belong is named with the reason and left out. The estimator sees no truth and takes no start from anybody.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.geometry.silhouettes import silhouettes
from estimator.merging.consistency import Consensus, agree, alone
from estimator.merging.fitted import Fitted, MergeSettings, fit_sets
from estimator.merging.joint import Joint, JointTask, Placements
from estimator.merging.placing import fitting, placed_by_all, stands
from estimator.merging.set_motion import MotionEffort, SetMotions, find_motions
from estimator.merging.view_set import ViewSet, view_set
from estimator.particle.particle import MINIMUM_VIEWS, view_agreement, view_poses
from estimator.particle.view_disagreement import disagreement
from estimator.particle.view_faults import view_fault

Array = NDArray[np.float64]
SETS_WITHOUT_LOOP = 2
"""So many sets make one pair, of which no loop can be made."""


@dataclass(frozen=True)
class LeftOut:
    """A set, or one view of it, that does not belong, and why."""

    name: str
    view: int | None
    reason: str


@dataclass(frozen=True)
class Merged:
    """One set of views; the particle's frame has the axes of the first placed set and its origin in the middle of that set's hull.

    ``placed``: numbers of the sets, in the order of ``joint``'s placements. ``outlines``, ``views`` (n): all views used, ``set_of`` and
    ``view_of`` (n,) the set's number and the view's in it, ``view_rms_px`` (n,) RMS ETE of each against those of other sets,
    ``set_rms_px`` (s,) alike of the placed sets. ``calibration_px``: by how much the rig's calibration misplaces a view; ``rig``: what was
    found of its errors, by camera (its number in a set): translation (m) and turn (rad) along the camera's axes (6,).
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
    rig: Mapping[int, Array]
    consensus: Consensus
    left_out: tuple[LeftOut, ...]


def merge(sets: Sequence[ViewSet], settings: MergeSettings, advance: Callable[[], None] = lambda: None) -> Merged:
    """Merge sets of views of one particle; ``advance`` is called for every pair that is done.

    Raises
    ------
    InputError
        Where no two sets can be placed against each other.
    """
    every = list(sets)
    full = [n for n, one in enumerate(every) if not one.is_small]
    if not full:
        raise InputError(f"drops {', '.join(s.name for s in every)}: expected one with at least {MINIMUM_VIEWS} usable views, got none.")
    consensus = _agreed([every[n] for n in full], settings, advance).renumbered(full)
    placed, fitted = _without_foreign_sets(every, consensus, settings)
    reasons: dict[int, str] = {}
    odd: tuple[LeftOut, ...] = ()
    for number in [n for n in range(len(every)) if n not in placed]:
        found = placed_by_all(every[number], fitted.as_one, settings.effort)
        if isinstance(found, str):
            agreeing, out = _agreeing(every[number], settings.foreign_view_ratio)
            again = placed_by_all(agreeing, fitted.as_one, settings.effort) if out else found
            if isinstance(again, str):
                reasons[number] = found + _of_a_group(every, number, consensus)
                continue
            every[number], found, odd = agreeing, again, (*odd, *out)
        at, placed = fitted.joint.placements, (*placed, number)
        start = Placements(np.concatenate([at.R, found[0][None]]), np.concatenate([at.t, found[1][None]]))
        fitted = fit_sets([every[i] for i in placed], start, settings)
    merged = _merged(every, placed, fitted, consensus, reasons)
    return replace(merged, left_out=(*odd, *merged.left_out))


def _agreeing(one: ViewSet, ratio: float) -> tuple[ViewSet, tuple[LeftOut, ...]]:
    """A set without the views that disagree with its others, and which; as it is where there are none, or too few others."""
    rms, foreign = view_agreement(one.seen, one.poses, one.centre, ratio)
    kept = np.flatnonzero(~foreign)
    if len(kept) == len(one) or len(kept) < MINIMUM_VIEWS:
        return one, ()
    fewer = view_set(one.name, [one.outlines[k] for k in kept], [one.views[k] for k in kept])
    typical = float(np.median(rms[kept]))
    out = [
        LeftOut(one.name, one.numbers[k], f"RMS ETE {rms[k]:.1f} px among the drop's views, the others' median {typical:.2f} px")
        for k in np.flatnonzero(foreign)
    ]
    return replace(fewer, numbers=tuple(one.numbers[k] for k in kept)), tuple(out)


def _of_a_group(sets: list[ViewSet], number: int, consensus: Consensus) -> str:
    """With which other sets one agrees that is not placed, in words; empty where with none."""
    agreeing = [sets[n].name for group in consensus.others if number in group for n in group if n != number]
    return f"; it agrees with {', '.join(agreeing)}: is that another particle?" if agreeing else ""


def _agreed(sets: list[ViewSet], settings: MergeSettings, advance: Callable[[], None]) -> Consensus:
    """The sets that loops of motions connect or, where no loop closes, the best pair between which one motion alone stands.

    Raises
    ------
    InputError
        Where there is no such pair.
    """
    motions = _motions(sets, settings.effort, advance)
    consensus = agree(sets, {pair: _only(found, fitting(sets[pair[0]], sets[pair[1]], found)[0]) for pair, found in motions.items()})
    if len(sets) == 1 or len(consensus.placed) > 1:
        return consensus
    standing = {pair: stands(sets[pair[0]], sets[pair[1]], found)[0] for pair, found in motions.items()}
    unique = [pair for pair, rows in standing.items() if len(rows) == 1]
    if unique:
        best = min(unique, key=lambda pair: float(motions[pair].poses.cost[standing[pair][0]]))
        return alone(sets, _only(motions[best], standing[best]))
    several = {pair: len(rows) for pair, rows in standing.items() if len(rows) > 1}
    raise InputError(_undecided(sets, several) if several else _nothing_agrees(sets, motions))


def _only(found: SetMotions, rows: NDArray[np.int64]) -> SetMotions:
    return replace(found, poses=found.poses.take(rows), rms_px=found.rms_px[rows])


def _without_foreign_sets(sets: list[ViewSet], consensus: Consensus, settings: MergeSettings) -> tuple[tuple[int, ...], Fitted]:
    """The joint fit of the placed sets, and once more without those of which no view belongs.

    Raises
    ------
    InputError
        Where fewer than two sets are left.
    """
    placed, start = consensus.placed, consensus.placements
    while True:
        fitted = fit_sets([sets[i] for i in placed], start, settings)
        belongs = [bool(fitted.task.used[fitted.task.set_of == k].any()) for k in range(len(placed))]
        if all(belongs) or len(placed) == 1:
            return placed, fitted
        rows = np.flatnonzero(belongs)
        if len(rows) < 2:
            raise InputError(f"drops {', '.join(s.name for s in sets)}: expected at least two whose views agree, got {len(rows)}.")
        placed, start = tuple(placed[k] for k in rows), fitted.joint.placements.take(rows)


def _motions(sets: list[ViewSet], effort: MotionEffort, advance: Callable[[], None]) -> dict[tuple[int, int], SetMotions]:
    motions = {}
    for j, i in combinations(range(len(sets)), 2):
        motions[i, j] = find_motions(sets[i], sets[j], (i, j), effort)
        advance()
    return motions


def _undecided(sets: list[ViewSet], several: Mapping[tuple[int, int], int]) -> str:
    """What to say where the pairs ``several`` fit in more than one way each, and no loop of three drops decides between them."""
    if len(sets) == SETS_WITHOUT_LOOP:
        return (
            f"drops {sets[0].name}, {sets[1].name}: expected one way of turning the second that fits the first, got "
            f"{next(iter(several.values()))}, as a symmetric body has. Further drops would decide."
        )
    names, pairs = ", ".join(s.name for s in sets), len(sets) * (len(sets) - 1) // 2
    return (
        f"drops {names}: expected ways of turning them that agree around three drops, got none. {len(several)} of {pairs} pairs of drops "
        f"fit each other in several ways, in up to {max(several.values())}, but no three of these agree: the drops show a body that is "
        "nearly alike from many sides, as a ball is, or particles that look alike. Is it one particle? Then views that show its corners "
        "would decide, or one of these drops alone makes a particle file."
    )


def _nothing_agrees(sets: list[ViewSet], motions: dict[tuple[int, int], SetMotions]) -> str:
    best = min((float(m.rms_px[0]) for m in motions.values() if len(m.rms_px)), default=float("inf"))
    worst = max(sets, key=_own)
    return (
        f"drops {', '.join(s.name for s in sets)}: expected views of one particle that agree once each drop is turned as a whole, got none "
        f"that do: the best pair of drops is off by {best:.2f} px RMS, views within a drop by up to {_own(worst):.2f} px. "
        + (view_fault(worst.outlines, worst.views) or "Is it one particle, and is the rig's calibration that of these pictures?")
    )


def _own(one: ViewSet) -> float:
    return disagreement(one.seen, one.poses, one.centre).rms_px


def _merged(sets: list[ViewSet], placed: tuple[int, ...], fitted: Fitted, consensus: Consensus, reasons: dict[int, str]) -> Merged:
    fitted = _about_the_middle(fitted)
    task, kept = fitted.task, fitted.kept
    outlines, views = fitted.as_one
    view_of = np.concatenate([sets[i].numbers for i in placed])
    view_rms, set_rms = _rms(task, fitted.joint)
    return Merged(
        placed=placed,
        joint=fitted.joint,
        outlines=tuple(outlines),
        views=tuple(replace(v, drop=placed[task.set_of[k]], camera=int(view_of[k])) for v, k in zip(views, kept, strict=True)),
        set_of=np.array(placed)[task.set_of[kept]],
        view_of=view_of[kept],
        view_rms_px=view_rms[kept],
        set_rms_px=set_rms,
        calibration_px=disagreement(silhouettes(outlines, [v.intrinsics for v in views]), view_poses(views), task.pivot).calibration_px,
        rig=_rig_found(task, fitted.joint.placements, view_of),
        consensus=consensus,
        left_out=_left_out(sets, placed, task, view_rms, reasons),
    )


def _rig_found(task: JointTask, at: Placements, view_of: NDArray[np.int64]) -> dict[int, Array]:
    if task.rig is None:
        return {}
    return {int(view_of[np.argmax(task.rig.camera_of == c)]): row for c, row in enumerate(at.corrections)}


def _about_the_middle(fitted: Fitted) -> Fitted:
    """The same with the pivot as origin of the particle's frame."""
    at = fitted.joint.placements
    moved = replace(at, t=at.t + at.R @ fitted.task.pivot)
    return replace(fitted, task=replace(fitted.task, pivot=np.zeros(3)), joint=replace(fitted.joint, placements=moved))


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
