"""Kinks in a path of centroids: found, placed between frames, and not taken for what gravity or wobble do."""

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.vocabulary.outline import Outline
from estimator.impacts.impact_search import CentroidPath, Kink, centroid_path, clear_kinks, find_kinks, step_angles
from estimator.outlines.result import FrameOutline, FrameStatus, OutlineTrack

Array = NDArray[np.float64]
FALL = np.array([0.0, 0.006])
"""px per frame², as gravity at 4000 frames per second and 0.1 mm per px."""


def path(impacts: list[float], *, frames: int = 90, velocities: list[Array] | None = None, wobble_px: float = 0.0) -> CentroidPath:
    """A path that bounces at ``impacts``, with a centroid that runs around a spinning body's centre of mass."""
    velocities = velocities or [np.array([0.3, 3.0]), np.array([1.2, -1.5]), np.array([0.8, 1.0])]
    t, place, c = np.arange(frames, dtype=np.float64), np.array([300.0, 200.0]), np.empty((frames, 2))
    starts = [0.0, *impacts]
    for start, end, v in zip(starts, [*impacts, float(frames)], velocities, strict=False):
        rows = (t >= start) & (t < end)
        s = (t[rows] - start)[:, None]
        c[rows] = place + v * s + 0.5 * FALL * s**2
        place = place + v * (end - start) + 0.5 * FALL * (end - start) ** 2
    turn = 0.08 * t
    c += wobble_px * np.column_stack([np.cos(turn), np.sin(turn)]) + np.random.default_rng(3).normal(scale=0.03, size=c.shape)
    return CentroidPath(np.arange(frames), c)


@pytest.mark.parametrize("at", [20.3, 44.62, 71.0])
def test_an_impact_is_placed_between_frames(at: float) -> None:
    (kink,) = find_kinks(path([at], wobble_px=1.0))
    assert kink.frame == pytest.approx(at, abs=0.4)
    assert kink.angle_rad > np.radians(60.0)


def test_a_flight_has_none() -> None:
    """Not even at the turning point of a rise, where steps turn by half a turn, nor where the centroid wobbles."""
    assert find_kinks(path([], wobble_px=2.0)) == []
    rising = path([], velocities=[np.array([0.02, -0.27])], wobble_px=0.5)
    assert step_angles(rising).max() > np.radians(60.0)
    assert find_kinks(rising) == []


def test_two_impacts_are_found_in_order() -> None:
    kinks = find_kinks(path([30.4, 52.7]))
    assert [k.frame for k in kinks] == pytest.approx([30.4, 52.7], abs=0.4)


def test_with_one_picture_after_it_a_kink_claims_the_smallest_jump() -> None:
    """Any time after the last but one picture fits as well, and the later it is the larger a jump it needs."""
    t = np.arange(21, dtype=np.float64)[:, None]
    c = 3.0 * t + 0.5 * FALL * t**2
    c[-1] += [4.0, -3.0]
    (kink,) = find_kinks(CentroidPath(np.arange(21), c))
    assert kink.frame == 19.0
    assert kink.jump_px == pytest.approx(5.0, rel=1e-6)


def test_too_few_frames_say_nothing() -> None:
    assert find_kinks(path([3.5], frames=6)) == []


def test_a_blotted_outline_is_left_out() -> None:
    square = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    frames = [FrameOutline(Outline(square * (2.0 if k == 5 else 1.0) + k), FrameStatus.USED) for k in range(12)]
    frames[8] = FrameOutline(Outline(np.zeros((0, 2))), FrameStatus.ABSENT)
    frames[10] = FrameOutline(frames[10].outline, FrameStatus.IN_PART)
    assert centroid_path(OutlineTrack(tuple(frames))).frame.tolist() == [0, 1, 2, 3, 4, 6, 7, 9, 11]
    found = centroid_path(OutlineTrack(tuple(frames)), in_part=True)
    assert found.frame.tolist() == [0, 1, 2, 3, 4, 6, 7, 9, 10, 11]
    np.testing.assert_allclose(found.c, 5.0 + np.repeat(found.frame[:, None], 2, axis=1))


def test_kinks_far_weaker_than_the_strongest_are_left_to_tracked_poses() -> None:
    strong, weak, second = Kink(40.0, 2.0, 5.0, 60.0), Kink(55.0, 0.3, 0.8, 14.0), Kink(60.0, 1.0, 2.0, 40.0)
    assert clear_kinks([strong, weak, second]) == [strong, second]
    assert clear_kinks([]) == []


def test_an_impact_in_a_gap_is_placed_within_it() -> None:
    """Frames near it are left out where a plate hides the particle's foot."""
    whole = path([44.3], wobble_px=1.0)
    kept = (whole.frame < 41) | (whole.frame > 48)
    (kink,) = find_kinks(CentroidPath(whole.frame[kept], whole.c[kept]))
    assert kink.frame == pytest.approx(44.3, abs=0.5)


def test_a_weak_kink_is_found_where_one_must_be() -> None:
    velocities = [np.array([0.3, 1.0]), np.array([0.55, 0.6])]
    weak = path([44.0], velocities=velocities)
    noisy = CentroidPath(weak.frame, weak.c + np.random.default_rng(1).normal(scale=0.22, size=weak.c.shape))
    assert find_kinks(noisy) == []
    assert 44.0 == pytest.approx(find_kinks(noisy, least_ratio=3.0)[0].frame, abs=1.5)
