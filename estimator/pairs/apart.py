"""When two particles are seen apart, and which outline follows which from picture to picture.

A picture shows two outlines where the particles are apart, one where they are not. Runs of pictures with two outlines are followed by
place: the outlines of a picture continue those before them such that the centroids move least from where their last step would carry them.
Between runs the two are hidden in one outline, so nothing follows through: whose outline is whose is decided for each run anew
(:mod:`estimator.pairs.associating`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.outline import Outline, signed_area
from estimator.impacts.impact_search import CentroidPath, centroid_path
from estimator.outlines.result import FrameOutline, FrameStatus, OutlineTrack, left_out

Array = NDArray[np.float64]
LEAST_RUN = 3
"""Pictures in a run; a shorter one between merged outlines is left out."""


@dataclass(frozen=True)
class Run:
    """Consecutive ``frames`` (n,) with two outlines each, followed: ``outlines[k]`` are those of one of the two, whichever it is."""

    frames: NDArray[np.int64]
    outlines: tuple[tuple[FrameOutline, ...], tuple[FrameOutline, ...]]


def runs_apart(larger: OutlineTrack, smaller: OutlineTrack) -> list[Run]:
    """The runs in which both outlines can be used."""
    frames = np.flatnonzero(larger.used & smaller.used).astype(np.int64)
    parts = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1) if len(frames) else []
    return [_followed(part, larger, smaller) for part in parts if len(part) >= LEAST_RUN]


def _followed(frames: NDArray[np.int64], larger: OutlineTrack, smaller: OutlineTrack) -> Run:
    first, second = [larger.frames[frames[0]]], [smaller.frames[frames[0]]]
    for frame in frames[1:]:
        seen = (larger.frames[frame], smaller.frames[frame])
        expected = (_next_place(first), _next_place(second))
        straight, crossed = (
            sum(float(np.linalg.norm(_centroid(s.outline) - e)) for s, e in zip(order, expected, strict=True))
            for order in (seen, seen[::-1])
        )
        one, other = seen if straight <= crossed else seen[::-1]
        first.append(one)
        second.append(other)
    return Run(frames, (tuple(first), tuple(second)))


def _next_place(followed: list[FrameOutline]) -> Array:
    last = _centroid(followed[-1].outline)
    return last if len(followed) < 2 else 2 * last - _centroid(followed[-2].outline)


def _centroid(outline: Outline) -> Array:
    points = outline.points_px
    x, y = (points - points[0]).T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    sums = np.array([np.sum((x + np.roll(x, -1)) * cross), np.sum((y + np.roll(y, -1)) * cross)])
    return np.asarray(sums / (6.0 * signed_area(points)) + points[0])


def track_of(runs: list[Run], whose: list[int], larger: OutlineTrack, smaller: OutlineTrack) -> OutlineTrack:
    """The outlines of one particle, ``whose[r]`` the followed one of run r; every other picture is left out with its reason."""
    frames = [_reason(a, b) for a, b in zip(larger.frames, smaller.frames, strict=True)]
    for run, which in zip(runs, whose, strict=True):
        for frame, outline in zip(run.frames, run.outlines[which], strict=True):
            frames[frame] = outline
    return OutlineTrack(tuple(frames))


def _reason(larger: FrameOutline, smaller: FrameOutline) -> FrameOutline:
    """Why a picture in which the two cannot be told apart is left out."""
    if not larger.used:
        return left_out(larger.status)
    if smaller.used:
        return left_out(FrameStatus.BRIEFLY_APART)
    return left_out(FrameStatus.MERGED if smaller.status is FrameStatus.ABSENT else smaller.status)


def joint_kink(tracks: tuple[OutlineTrack, OutlineTrack], among: Array) -> tuple[float, tuple[float, float]]:
    """The frame (continuous) among ``among`` (n,) at which both paths bend together, and by how much (px per frame) each does.

    Over the whole sequence two parabolas of common acceleration that meet there, for both particles at once: unlike the search of
    :mod:`estimator.impacts.impact_search`, it needs no pictures near the impact, when the two are mostly hidden in one outline.
    """
    paths = [centroid_path(track) for track in tracks]
    left = [sum(_bent(path, float(at))[1] for path in paths) for at in among]
    best = float(among[int(np.argmin(left))])
    first, second = (_bent(path, best)[0] for path in paths)
    return best, (first, second)


def _bent(path: CentroidPath, at: float) -> tuple[float, float]:
    """The bend (px per frame) of a path at frame ``at`` and the squares that it leaves; a bend at an end leaves everything."""
    s = path.frame - at
    if s.min() > -LEAST_RUN + 1 or s.max() < LEAST_RUN - 1:
        return 0.0, float("inf")
    A = np.column_stack([np.ones_like(s), np.minimum(s, 0.0), np.maximum(s, 0.0), 0.5 * s**2])
    found, *_ = np.linalg.lstsq(A, path.c, rcond=None)
    return float(np.linalg.norm(found[2] - found[1])), float(np.sum((A @ found - path.c) ** 2))
