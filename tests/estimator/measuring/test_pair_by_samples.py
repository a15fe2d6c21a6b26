"""Two particles that collide, each fitted to its own samples: both end at one time, as sure of it as both together are."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from datasets.estimate import Estimate, Status
from datasets.scoring.collisions import parts_of
from datasets.scoring.impacts import score_impacts
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.measure import measure
from estimator.measuring import two_particles
from estimator.measuring.pair_by_samples import bound_together
from estimator.motion.piecewise import TIME, named
from estimator.pairs.pair_fit import SHARED, PairRefined
from estimator.surface import joint as joint_module
from estimator.surface.star_surface import star_surface
from synth.sequence import build_silhouette_sequence
from tests.reference.golden_cases import PAIR

QUICK = Configuration(hull_resolution=32, directions=200, pose_starts=24, momentum_starts=0, bias_pairs=2, surface_fit=0)
COARSE = 4


@pytest.fixture(scope="module", autouse=True)
def coarse() -> Iterator[None]:
    """Surfaces of a quarter of the corners: a quarter of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_module, "star_surface", partial(star_surface, subdivisions=COARSE))
        yield


@pytest.fixture(scope="module")
def found() -> tuple[Estimate, Estimate, Truth, list[tuple[Any, PairRefined]]]:
    """By samples, by tangents, the truth, and what was bound together."""
    observation, truth = build_silhouette_sequence(PAIR, 0)
    given: list[tuple[Any, PairRefined]] = []

    def bound(*arguments: Any) -> PairRefined:
        given.append((arguments[0], together := bound_together(*arguments)))
        return together

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(two_particles, "bound_together", bound)
        samples = measure(observation, replace(QUICK, surface_fit=2))
    return samples, measure(observation, QUICK), truth, given


def test_both_are_nearer_to_the_truth(found: tuple[Estimate, Estimate, Truth, Any]) -> None:
    samples, tangents, truth, _ = found
    assert samples.status is Status.CONVERGED
    assert samples.companion is not None
    assert "surface" in samples.statistics
    assert "surface" in samples.companion.statistics
    errors = []
    for estimate in (samples, tangents):
        rows = [row for _, part, true in parts_of(estimate, truth) for row in score_impacts(part, true)]
        assert len(rows) == 2
        errors.append([np.hypot(row["before_angular_rads"], row["after_angular_rads"]) for row in rows])
    assert np.linalg.norm(errors[0]) < np.linalg.norm(errors[1])


def test_the_time_of_the_impact_is_one_and_known_by_both(found: tuple[Estimate, Estimate, Truth, Any]) -> None:
    (joints, free), _ = found[3]
    times = [flight.times_s[0] for flight in free.state.both]
    assert times[0] == pytest.approx(times[1], abs=1e-12)
    place = free.state.layout[SHARED]
    together = free.covariance[place, place].item()
    alone = [joint.covariance[joint.motion.layout[named(TIME, 0)]][:, joint.motion.layout[named(TIME, 0)]].item() for joint in joints]
    assert 1.0 / together == pytest.approx(1.0 / alone[0] + 1.0 / alone[1], rel=1e-3)


def test_hulls_that_touch_say_more(found: tuple[Estimate, Estimate, Truth, Any]) -> None:
    (_, free), (_, held) = found[3]
    depth = free.state.layout["x"].start + 2
    assert held.covariance[depth, depth] <= free.covariance[depth, depth]
