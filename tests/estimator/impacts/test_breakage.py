"""A particle broke where the flight before an impact is that of the calibrated views and the one after it is not."""

import pytest

from datasets.estimate import Estimate, Status
from estimator.impacts.breakage import worse_part


def part(status: Status, mean_square: float | None) -> Estimate:
    statistics = {} if mean_square is None else {"noise_mean_square": mean_square}
    return Estimate(name="drop", status=status, message="", frames=(), statistics=statistics, configuration={}, versions={})


@pytest.mark.parametrize(
    ("after", "told"),
    [
        (part(Status.NO_CONVERGENCE, 81.0), "within 0.9 times their noise, after it 9.0 times it"),
        (part(Status.NO_CONVERGENCE, None), "after it no flight fits"),
        (part(Status.CONVERGED, 4.0), "after it 2.0 times it"),
    ],
)
def test_only_the_first_part_fits(after: Estimate, told: str) -> None:
    said = worse_part(part(Status.CONVERGED, 0.81), after, 44.21)
    assert said is not None
    assert "broke" in said
    assert "at frame 44.2" in said
    assert told in said


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (part(Status.CONVERGED, 0.9), part(Status.CONVERGED, 1.1)),
        (part(Status.CONVERGED, 9.0), part(Status.NO_CONVERGENCE, 81.0)),
        (part(Status.NO_CONVERGENCE, None), part(Status.NO_CONVERGENCE, None)),
        (part(Status.CONVERGED, 0.9), part(Status.NOT_ENOUGH_FRAMES, None)),
    ],
    ids=["both fit", "neither does", "neither is measured", "too short to say"],
)
def test_nothing_is_said_otherwise(before: Estimate, after: Estimate) -> None:
    assert worse_part(before, after, 44.2) is None
