"""Outlines followed while two particles are apart, and the bend that both paths share."""

import numpy as np
import pytest

from datasets.vocabulary.outline import Outline
from estimator.outlines.result import FrameOutline, FrameStatus, OutlineTrack, left_out
from estimator.pairs.apart import joint_kink, runs_apart, track_of

ANGLES = np.linspace(0, 2 * np.pi, 60, endpoint=False)
CIRCLE = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
MERGED = range(9, 13)
HIT = 10.6


def place(which: int, frame: float) -> np.ndarray:
    """Towards one another until the hit, then apart and downwards."""
    sign = 1.0 if which == 0 else -1.0
    along, down = min(frame - HIT, 0.0), max(frame - HIT, 0.0)
    return np.array([300.0 + sign * (4.0 * along - 1.5 * down), 300.0 + sign * (2.0 * down - 1.0)])


def tracks(merged: range = MERGED) -> tuple[OutlineTrack, OutlineTrack]:
    """The larger one is the first in even frames and the second in odd ones."""
    larger, smaller = [], []
    for frame in range(24):
        ring = [FrameOutline(Outline((6.0 + 0.3 * ((frame + k) % 2)) * CIRCLE + place(k, frame)), FrameStatus.USED) for k in (0, 1)]
        if frame in merged:
            larger.append(ring[0])
            smaller.append(left_out(FrameStatus.ABSENT))
            continue
        ring.sort(key=lambda f: -np.ptp(f.outline.points_px[:, 0]))
        larger.append(ring[0])
        smaller.append(ring[1])
    return OutlineTrack(tuple(larger)), OutlineTrack(tuple(smaller))


def test_outlines_are_followed_within_runs() -> None:
    larger, smaller = tracks()
    runs = runs_apart(larger, smaller)
    assert [(int(r.frames[0]), int(r.frames[-1])) for r in runs] == [(0, 8), (13, 23)]
    for run in runs:
        for followed in run.outlines:
            sides = {
                int(np.argmin([np.linalg.norm(f.outline.points_px.mean(axis=0) - place(k, n)) for k in (0, 1)]))
                for n, f in zip(run.frames, followed, strict=True)
            }
            assert len(sides) == 1


def test_what_is_left_out_says_why() -> None:
    larger, smaller = tracks(range(9, 13))
    brief = (*smaller.frames[:11], smaller.frames[10], *smaller.frames[12:])
    smaller = OutlineTrack((*brief[:10], larger.frames[10], *brief[11:]))
    runs = runs_apart(larger, smaller)
    track = track_of(runs, [0, 0], larger, smaller)
    assert track.reasons[9] == FrameStatus.MERGED
    assert track.reasons[10] == FrameStatus.BRIEFLY_APART
    assert track.used.sum() == 20


def test_the_bend_that_both_share() -> None:
    larger, smaller = tracks()
    runs = runs_apart(larger, smaller)
    first = [int(np.linalg.norm(r.outlines[1][0].outline.points_px.mean(axis=0) - place(0, r.frames[0])) < 1.0) for r in runs]
    both = (track_of(runs, first, larger, smaller), track_of(runs, [1 - f for f in first], larger, smaller))
    at, bends = joint_kink(both, np.arange(3.0, 20.0, 0.1))
    assert at == pytest.approx(HIT, abs=0.06)
    assert bends == pytest.approx((np.hypot(5.5, 2.0),) * 2, rel=0.02)
