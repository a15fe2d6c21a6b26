"""What is said of trajectories before anything is fitted."""

from dataclasses import replace

import numpy as np
import pytest

from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tumble.campaigning import repeated_words


@pytest.mark.parametrize("orientation", [True, False])
def test_rows_that_repeat_the_one_before_are_said(orientation: bool) -> None:
    """A film of half the rate stored at the whole one: every second row is a copy."""
    made = campaign(3, Hidden(), Tracker(rows=40, orientation=orientation), sequences=2)
    copies = np.arange(40) // 2 * 2
    turned = (None if t.q_world_tracked is None else t.q_world_tracked[copies] for t in made)
    stored = [replace(t, x_world=t.x_world[copies], q_world_tracked=q) for t, q in zip(made, turned, strict=True)]
    (said,) = repeated_words({t.name: t for t in stored})
    assert said.startswith("40 of 80 rows repeat the one before them to the last digit, in 2 of 2 sequences")
    assert repeated_words({t.name: t for t in made}) == ()


def test_a_coarsely_rounded_row_or_two_are_not() -> None:
    """Heights to a centimetre repeat near the top, where nothing moves; rows without positions repeat nothing."""
    made = campaign(3, Hidden(), Tracker(rows=40, orientation=False), sequences=4)
    rounded = [replace(t, x_world=np.round(t.x_world, 2)) for t in made]
    gone = [replace(t, x_world=np.where(np.arange(40)[:, None] < 20, np.nan, t.x_world)) for t in made]
    assert repeated_words({t.name: t for t in rounded}) == ()
    assert repeated_words({t.name: t for t in gone}) == ()
