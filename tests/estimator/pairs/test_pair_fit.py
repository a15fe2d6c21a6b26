"""The parameters of a pair, and what its status says."""

import numpy as np
import pytest

from datasets.estimate import Status
from datasets.vocabulary.body import Body
from estimator.measuring.two_particles import _together
from estimator.motion.flight import Flight
from estimator.motion.piecewise import Bounce, PiecewiseFlight
from estimator.pairs.associating import LEAST_RATIO
from estimator.pairs.pair_fit import SHARED, PairFlight, at_one_time


def flight(shift: float, time_s: float = 4e-3) -> PiecewiseFlight:
    first = Flight(
        time_s=0.0,
        x=np.array([shift, 0.0, 0.6]),
        q=np.array([0.0, 0.0, 0.0, 1.0]),
        v=np.array([1.0, 0.0, 0.0]),
        omega=np.array([10.0, 20.0, 30.0]),
        body=Body(np.zeros(3), np.eye(3), np.array([0.6, 0.8, 1.0])),
        com=np.zeros(3),
        inertia=np.zeros(5),
        offset_px=0.0,
        gravity_world=np.zeros(3),
    )
    return PiecewiseFlight(first, (Bounce(time_s, np.array([0.0, 1.0, 0.0]), np.zeros(3)),))


def test_one_time_and_everything_else_apart() -> None:
    pair = PairFlight(flight(0.0), flight(0.01))
    step = np.random.default_rng(1).normal(size=pair.layout.size) * 1e-3
    moved, (first, second) = pair.moved(step), pair.places
    assert moved.first.bounces[0].time_s == moved.second.bounces[0].time_s == pytest.approx(4e-3 + step[pair.layout[SHARED]].item())
    for found, start, place in ((moved.first, flight(0.0), first), (moved.second, flight(0.01), second)):
        own = start.moved(step[place])
        assert np.array_equal(found.first.x, own.first.x)
        assert np.array_equal(found.bounces[0].v, own.bounces[0].v)
        assert np.allclose(moved.values[place], found.values)
    assert np.array_equal(np.union1d(first, second), np.arange(pair.layout.size))
    assert np.intersect1d(first, second).tolist() == pair.layout.columns([SHARED]).tolist()


def test_the_time_both_start_from() -> None:
    pair = at_one_time(flight(0.0, 4e-3), flight(0.01, 5e-3), (3.0, 1.0))
    assert [f.bounces[0].time_s for f in pair.both] == pytest.approx([4.25e-3] * 2)


@pytest.mark.parametrize(
    ("first", "second", "ratio", "expected"),
    [
        (Status.CONVERGED, Status.CONVERGED, 10.0, Status.CONVERGED),
        (Status.CONVERGED, Status.CONVERGED, LEAST_RATIO - 0.1, Status.AMBIGUOUS),
        (Status.AMBIGUOUS, Status.NO_CONVERGENCE, 10.0, Status.NO_CONVERGENCE),
        (Status.SECOND_CONTACT, Status.AMBIGUOUS, 10.0, Status.SECOND_CONTACT),
    ],
)
def test_the_worse_of_both(first: Status, second: Status, ratio: float, expected: Status) -> None:
    status, message = _together([(first, "one"), (second, "other")], ratio)
    assert status is expected
    if expected in {Status.NO_CONVERGENCE, Status.SECOND_CONTACT}:
        assert message == ("the second particle: other" if second is expected else "the first particle: one")
