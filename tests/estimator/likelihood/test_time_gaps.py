"""The stretch on the longer side of a jump; free flights, slow ones, impacts and known gaps have none."""

import numpy as np
import pytest

from estimator.likelihood.time_gaps import longest_stretch

TIMES = np.arange(80) / 4000.0
WHOLE = slice(0, 80)


def seen(times_s: np.ndarray, speed_px: float = 12000.0, noise_px: float = 0.05) -> np.ndarray:
    """Centres of a body that flies, falls and wobbles, seen with noise."""
    rng = np.random.default_rng(3)
    path = np.column_stack([speed_px * times_s, 0.4 * speed_px * times_s + 4e4 * times_s**2])
    wobble = 0.8 * np.column_stack([np.cos(900.0 * times_s), np.sin(900.0 * times_s)])
    return path + wobble + noise_px * rng.normal(size=path.shape)


def late(after: int, frames: float) -> np.ndarray:
    """True times where ``frames`` intervals are missing after a frame."""
    return TIMES + np.where(np.arange(80) > after, frames / 4000.0, 0.0)


@pytest.mark.parametrize("frames", [1.0, 3.0])
@pytest.mark.parametrize(("after", "stretch"), [(20, slice(21, 80)), (55, slice(0, 56))])
def test_the_longer_side_of_a_gap_is_kept(frames: float, after: int, stretch: slice) -> None:
    assert longest_stretch(seen(late(after, frames)), TIMES) == stretch


def test_a_free_flight_is_kept_whole() -> None:
    assert longest_stretch(seen(TIMES), TIMES) == WHOLE
    assert longest_stretch(seen(TIMES, speed_px=0.0), TIMES) == WHOLE


def test_a_gap_that_the_time_stamps_tell_is_none() -> None:
    true = late(30, 3.0)
    assert longest_stretch(seen(true), true) == WHOLE


def test_a_rebound_is_no_gap() -> None:
    centres = seen(TIMES)
    centres[40:, 1] = 2 * centres[40, 1] - centres[40:, 1]
    assert longest_stretch(centres, TIMES) == WHOLE


def test_a_few_frames_are_kept_whole() -> None:
    assert longest_stretch(seen(late(3, 2.0))[:7], TIMES[:7]) == slice(0, 7)
