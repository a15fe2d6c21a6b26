"""Impacts of trajectories: what is found, how well it is known, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from estimator.measurements.trajectories.free_flights import Run, free_flights, path_noise
from estimator.measurements.trajectories.impacts import may_have_impacts, measure_impacts
from tests.estimator.measurements.trajectories.struck_tosses import GRAVITY, RATE_HZ, SIGMA_X, Toss, lying, toss


@pytest.fixture(scope="module")
def tosses() -> list[Toss]:
    rng = np.random.default_rng(5)
    return [toss(rng) for _ in range(12)]


@pytest.fixture(scope="module")
def estimates(tosses: list[Toss]) -> tuple[Estimate, ...]:
    return measure_impacts([t.trajectory for t in tosses])


def test_every_impact_is_found_where_it_was(tosses: list[Toss], estimates: tuple[Estimate, ...]) -> None:
    for known, estimate in zip(tosses, estimates, strict=True):
        assert estimate.status is Status.CONVERGED
        assert len(estimate.impacts) == len(known.hits) == 1
        assert len(estimate.segments) == 2
        impact, hit = estimate.impacts[0], known.hits[0]
        assert abs(impact.time_s - hit.time_s) < 0.1 / RATE_HZ
        assert estimate.segments[0].end_s == impact.time_s == estimate.segments[1].start_s
        assert "1 impact, 2 free flights" in estimate.message


def test_velocities_and_their_covariances_agree_with_the_truth(tosses: list[Toss], estimates: tuple[Estimate, ...]) -> None:
    scores, times = [], []
    for known, estimate in zip(tosses, estimates, strict=True):
        impact, hit = estimate.impacts[0], known.hits[0]
        said = np.concatenate([impact.before.v_world, impact.before.omega_world, impact.after.v_world, impact.after.omega_world])
        off = said - np.concatenate([hit.before, hit.after])
        scores.append(off @ np.linalg.solve(impact.covariance[6:, 6:], off))
        times.append(((impact.time_s - hit.time_s) / impact.time_sigma_s) ** 2)
        assert np.sqrt(np.diag(impact.covariance)[12:15]).max() < 0.02
        assert np.sqrt(np.diag(impact.covariance)[15:18]).max() < 0.2
        np.testing.assert_array_equal(impact.after.covariance, impact.covariance[12:, 12:])
    # Sums over twelve impacts of squared errors over their variance; accelerations that may be there and are not keep them below the mean.
    assert chi2.ppf(1e-6, 12 * len(scores)) < sum(scores) < chi2.ppf(0.999, 12 * len(scores))
    assert chi2.ppf(1e-3, len(times)) < sum(times) < chi2.ppf(0.999, len(times))


def test_one_pose_belongs_to_both_flights(estimates: tuple[Estimate, ...]) -> None:
    for estimate in estimates:
        told = estimate.statistics["impacts"][0]
        assert told["gap_m"] < 5e-4
        assert told["rows_in_contact"] == 0
        assert np.linalg.eigvalsh(estimate.impacts[0].covariance)[0] > -1e-12


def test_a_free_flight_has_no_impact() -> None:
    rng = np.random.default_rng(3)
    flights = [toss(rng, rows=30, height=1.0).trajectory for _ in range(4)]
    assert not may_have_impacts(flights)
    for estimate in measure_impacts(flights):
        assert estimate.status is Status.CONVERGED
        assert estimate.impacts == ()
        assert "without impact" in estimate.message


def test_what_lies_where_it_fell_has_no_second_flight(tosses: list[Toss]) -> None:
    rng = np.random.default_rng(4)
    row = int(tosses[0].hits[0].time_s * RATE_HZ) + 1
    trajectory = lying(tosses[0], rng, until=row, rows=30)
    assert may_have_impacts([trajectory])
    (estimate,) = measure_impacts([trajectory])
    assert estimate.status is Status.RESTING
    assert estimate.impacts == ()
    assert estimate.middle is None
    assert f"rows {row} to {row + 29}" in estimate.message
    assert "rests, rolls, slides" in estimate.message


@pytest.mark.parametrize("after", [1, 2, 3])
def test_an_impact_in_the_last_rows_is_refused(tosses: list[Toss], after: int) -> None:
    known = _between_rows(tosses)
    trajectory = _rows(known, slice(0, int(np.ceil(known.hits[0].time_s * RATE_HZ)) + after))
    (estimate,) = measure_impacts([trajectory])
    assert estimate.status is Status.IMPACT_AT_EDGE
    assert estimate.impacts == ()
    assert f"last {after} rows" in estimate.message


@pytest.mark.parametrize("before", [1, 2, 3])
def test_an_impact_in_the_first_rows_is_refused(tosses: list[Toss], before: int) -> None:
    known = _between_rows(tosses)
    first = int(np.ceil(known.hits[0].time_s * RATE_HZ)) - before
    (estimate,) = measure_impacts([_rows(known, slice(first, None))])
    assert estimate.status is Status.IMPACT_AT_EDGE
    assert f"first {before} rows" in estimate.message


def _between_rows(tosses: list[Toss]) -> Toss:
    """One that hits in the middle between two rows: a row at the very impact belongs to both flights."""
    return next(t for t in tosses if 0.3 < (t.hits[0].time_s * RATE_HZ) % 1.0 < 0.7)


def _rows(known: Toss, rows: slice):  # type: ignore[no-untyped-def]
    t = known.trajectory
    assert t.q_world_tracked is not None
    return replace(t, times_s=t.times_s[rows] - t.times_s[rows][0], x_world=t.x_world[rows], q_world_tracked=t.q_world_tracked[rows])


def test_two_contacts_within_a_frame_are_told_and_widen_the_uncertainty() -> None:
    rng = np.random.default_rng(8)
    known = toss(rng, pushes=((0.0, 0.8), (0.006, 0.6)))
    (estimate,) = measure_impacts([known.trajectory])
    assert estimate.status is Status.CONVERGED
    assert len(estimate.impacts) == 1
    assert "a second contact at once, or one that lasts" in estimate.message
    assert estimate.statistics["impacts"][0]["spread_s"] > 1e-4
    impact = estimate.impacts[0]
    assert impact.time_sigma_s > 1e-4
    last = known.hits[-1]
    # "After" is the second flight, at the one time of impact.
    carried = last.after[:3] + GRAVITY * (impact.time_s - last.time_s)
    off = np.abs(impact.after.v_world - carried) / np.sqrt(np.diag(impact.covariance)[12:15])
    assert off.max() < 4.0


def test_poses_are_needed(tosses: list[Toss]) -> None:
    bare = replace(tosses[0].trajectory, q_world_tracked=None)
    assert not may_have_impacts([bare])
    with pytest.raises(InputError, match="toss: expected orientations"):
        measure_impacts([bare])


def test_too_few_rows_for_gravity_to_show_are_told(tosses: list[Toss]) -> None:
    trajectory = _rows(tosses[0], slice(0, 12))
    (estimate,) = measure_impacts([replace(trajectory, sigma_x=np.full((12, 3), 0.01))])
    assert estimate.status is Status.NOT_ENOUGH_FRAMES
    assert "12 rows, where gravity shows over the noise only in" in estimate.message


def test_a_resting_thing_is_in_no_flight() -> None:
    times = np.arange(60) / RATE_HZ
    rng = np.random.default_rng(1)
    still = rng.normal(0.0, SIGMA_X, (60, 3))
    assert free_flights(times, still, GRAVITY, SIGMA_X) == ()
    rolling = still + np.column_stack([0.3 * times, 0.0 * times, 0.0 * times])
    assert free_flights(times, rolling, GRAVITY, SIGMA_X) == ()


def test_flights_need_more_rows_where_noise_is_larger(tosses: list[Toss]) -> None:
    t = tosses[0].trajectory
    assert path_noise([(t.times_s, t.x_world)]) == pytest.approx(SIGMA_X, rel=0.5)
    runs = free_flights(t.times_s, t.x_world, GRAVITY, SIGMA_X)
    assert runs[0].first == 0
    assert runs[0].last == int(np.ceil(tosses[0].hits[0].time_s * RATE_HZ))
    assert runs[-1] == Run(runs[0].last, len(t.times_s))
    short = slice(0, 8)
    assert free_flights(t.times_s[short], t.x_world[short], GRAVITY, SIGMA_X) == (Run(0, 8),)
    assert free_flights(t.times_s[short], t.x_world[short], GRAVITY, 2e-3) == ()
