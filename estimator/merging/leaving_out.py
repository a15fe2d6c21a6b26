"""Every set taken out and placed again against the views of all others, from no start: what the merging would say had it come last."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.merging.fitted import MergeSettings, fit_sets
from estimator.merging.joint import Placements
from estimator.merging.merge import Merged
from estimator.merging.placing import placed_by_all
from estimator.merging.view_set import ViewSet


@dataclass(frozen=True)
class SetAgain:
    """A set placed again: how far from the merged placement in turn (degrees) and place (m), or ``fault``, why it could not be placed."""

    name: str
    turned_deg: float
    moved_m: float
    fault: str = ""


def sets_again(sets: Sequence[ViewSet], merged: Merged, settings: MergeSettings) -> tuple[SetAgain, ...]:
    """All placed sets in turn; none where there are fewer than three."""
    if len(merged.placed) <= 2:
        return ()
    return tuple(_again(sets, merged, k, settings) for k in range(len(merged.placed)))


def _again(sets: Sequence[ViewSet], merged: Merged, k: int, settings: MergeSettings) -> SetAgain:
    """The others are fitted without the set first, and their mean motion against the merged ones is taken off."""
    at, rest = merged.joint.placements, [i for i in range(len(merged.placed)) if i != k]
    one = sets[merged.placed[k]]
    others = [sets[merged.placed[i]] for i in rest]
    start = Placements(at.R[rest], at.t[rest])
    fitted = fit_sets(others, start, settings)
    found = placed_by_all(one, fitted.as_one, settings.effort)
    if isinstance(found, str):
        return SetAgain(one.name, float("nan"), float("nan"), found)
    R, t = found
    now = fitted.joint.placements
    turn = Rotation.from_matrix(start.R.transpose(0, 2, 1) @ now.R).mean().as_matrix()
    shift = np.mean(np.einsum("sji,sj->si", start.R, now.t - start.t), axis=0)
    R_back = R @ turn.T
    t_back = t - R_back @ shift
    turned = float(np.rad2deg(Rotation.from_matrix(R_back @ at.R[k].T).magnitude()))
    return SetAgain(one.name, turned, float(np.linalg.norm(t_back - at.t[k])))
