"""Which of the pairwise motions to believe: those that agree around cycles, and the tree of sets that they span.

Three motions between three sets close a loop, ``X_ij X_jk X_ki = 1``, if all are right; wrong ones close none [Govindu 2004; Zach,
Klopschitz and Pollefeys 2010]. A motion's votes are the third sets over which it closes a loop with any motion of the two other pairs.
Each pair keeps its motion of most votes (of least cost among equals); pairs without a vote are no edge. The largest group of sets that
edges connect is placed along the tree of least cost. Of two sets no loop can be made: see :func:`alone`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial.transform import Rotation

from estimator.merging.joint import Placements
from estimator.merging.set_motion import SetMotions
from estimator.merging.view_set import ViewSet

Array = NDArray[np.float64]
LOOP_RAD = np.deg2rad(4.0)
"""A loop closes within this turn: sets of six views are turned right to 0.1° (outlines of 0.2 px) or 1° (calibrations off by a pixel)."""
LOOP_SHARE = 0.03
"""And within this share of the particle's extent."""
KEPT = 4
"""Motions of a pair that are looked at: a body that is nearly symmetric has as many of about equal cost."""
Pair = tuple[int, int]


@dataclass(frozen=True)
class Edge:
    """The chosen motion between two sets: its cost and the loops that it closes.

    ``R`` (3, 3), ``t`` (3,) m map the second's frame to the first's.
    """

    R: Array
    t: Array
    cost: float
    votes: int
    rms_px: float


@dataclass(frozen=True)
class Consensus:
    """The ``edges`` believed, the sets that hang together (``placed``, ascending) and where the particle lies in each of these.

    The particle's frame is that of the first of them. ``others``: sets that hang together apart from these, as another particle's do.
    """

    edges: Mapping[Pair, Edge]
    placed: tuple[int, ...]
    placements: Placements
    others: tuple[tuple[int, ...], ...] = ()

    def renumbered(self, numbers: Sequence[int]) -> "Consensus":
        """The same where set ``k`` is set ``numbers[k]``."""
        return Consensus(
            edges={(numbers[i], numbers[j]): edge for (i, j), edge in self.edges.items()},
            placed=tuple(numbers[k] for k in self.placed),
            placements=self.placements,
            others=tuple(tuple(numbers[k] for k in group) for group in self.others),
        )


def agree(sets: list[ViewSet], motions: Mapping[Pair, SetMotions]) -> Consensus:
    """The sets that motions connect, and where; ``motions[i, j]`` for i > j leads from set j to set i."""
    candidates = {pair: _candidates(sets, found) for pair, found in motions.items()}
    edges = {pair: edge for pair, some in candidates.items() if (edge := _chosen(pair, some, candidates, sets)) is not None}
    weights = csr_array(
        ([1e-12 + e.cost for e in edges.values()], ([p[0] for p in edges], [p[1] for p in edges])) if edges else (len(sets),) * 2,
        shape=(len(sets),) * 2,
    )
    labels = connected_components(weights, directed=False)[1]
    largest = int(np.argmax(np.bincount(labels)))
    placed = tuple(np.flatnonzero(labels == largest).tolist())
    groups = [tuple(np.flatnonzero(labels == label).tolist()) for label in np.unique(labels) if label != largest]
    return Consensus(edges, placed, _along_tree(placed, weights, edges), tuple(group for group in groups if len(group) > 1))


def alone(sets: list[ViewSet], found: SetMotions) -> Consensus:
    """What the best motion between two sets alone says, which no loop has checked."""
    edge = _candidates(sets, found)[0]
    first = min(found.first, found.second)
    second = max(found.first, found.second)
    step = _step(second, first, {(found.first, found.second): edge})
    placements = Placements(np.stack([np.eye(3), step[0]]), np.stack([np.zeros(3), step[1]]))
    return Consensus({(found.first, found.second): edge}, (first, second), placements)


def _candidates(sets: list[ViewSet], found: SetMotions) -> list[Edge]:
    second = sets[found.second].centre
    rows = range(min(KEPT, len(found.rms_px)))
    return [
        Edge(found.poses.R[n], found.poses.centre_cam[n] - found.poses.R[n] @ second, float(found.poses.cost[n]), 0, float(found.rms_px[n]))
        for n in rows
    ]


def _chosen(pair: Pair, some: list[Edge], every: Mapping[Pair, list[Edge]], sets: list[ViewSet]) -> Edge | None:
    """The candidate of most votes; none where no loop closes."""
    thirds = [k for k in range(len(sets)) if k not in pair]
    if not some or not thirds:
        return None
    votes = [sum(_closes(pair, edge, k, every, sets) for k in thirds) for edge in some]
    best = max(range(len(some)), key=lambda n: (votes[n], -some[n].cost))
    if votes[best] == 0:
        return None
    return Edge(some[best].R, some[best].t, some[best].cost, votes[best], some[best].rms_px)


def _closes(pair: Pair, edge: Edge, third: int, every: Mapping[Pair, list[Edge]], sets: list[ViewSet]) -> bool:
    i, j = pair
    return any(
        _same_motion((a[0] @ b[0], a[0] @ b[1] + a[1]), (edge.R, edge.t), sets[j])
        for a in _between(i, third, every)
        for b in _between(third, j, every)
    )


def _between(i: int, j: int, every: Mapping[Pair, list[Edge]]) -> list[tuple[Array, Array]]:
    """The candidate motions from set j to set i."""
    if (i, j) in every:
        return [(e.R, e.t) for e in every[i, j]]
    return [(e.R.T, -e.R.T @ e.t) for e in every.get((j, i), [])]


def _same_motion(a: tuple[Array, Array], b: tuple[Array, Array], moved: ViewSet) -> bool:
    turn = float(Rotation.from_matrix(a[0] @ b[0].T).magnitude())
    apart = float(np.linalg.norm((a[0] - b[0]) @ moved.centre + a[1] - b[1]))
    return turn <= LOOP_RAD and apart <= LOOP_SHARE * moved.extent_m


def _along_tree(placed: tuple[int, ...], weights: csr_array, edges: Mapping[Pair, Edge]) -> Placements:
    """Placements chained from the first placed set along the tree of least cost."""
    R = {placed[0]: np.eye(3)}
    t = {placed[0]: np.zeros(3)}
    order, before = breadth_first_order(minimum_spanning_tree(weights), placed[0], directed=False)
    for number in order[1:].tolist():
        parent = int(before[number])
        step = _step(number, parent, edges)
        R[number], t[number] = step[0] @ R[parent], step[0] @ t[parent] + step[1]
    return Placements(np.stack([R[i] for i in placed]), np.stack([t[i] for i in placed]))


def _step(i: int, j: int, edges: Mapping[Pair, Edge]) -> tuple[Array, Array]:
    edge = edges.get((i, j))
    if edge is not None:
        return edge.R, edge.t
    back = edges[j, i]
    return back.R.T, -back.R.T @ back.t
