"""Impacts with too few pictures between them are taken as one before flights are fitted between impacts."""

import numpy as np
import pytest

from estimator.impacts.segments import nearest_as_one, with_pictures_between

TIMES = np.repeat(np.arange(20.0), 2)
"""Two cameras: two sightings in every frame."""
FRAME = np.repeat(np.arange(20), 2)


@pytest.mark.parametrize(
    ("impacts", "expected"),
    [
        ([5.5], [5.5]),
        ([5.5, 7.6], [5.5, 7.6]),
        ([5.5, 6.6], [6.05]),
        ([3.2, 5.5, 6.6, 12.5], [3.2, 6.05, 12.5]),
        ([5.5, 6.6, 7.4], [6.25]),
    ],
)
def test_two_pictures_lie_between_impacts_that_stay_apart(impacts: list[float], expected: list[float]) -> None:
    merged = with_pictures_between(TIMES, FRAME, np.array(impacts), 2)
    assert merged == pytest.approx(expected)


def test_the_nearest_two_become_one_between_them() -> None:
    assert nearest_as_one(np.array([1.0, 4.0, 5.0, 9.0])) == pytest.approx([1.0, 4.5, 9.0])
