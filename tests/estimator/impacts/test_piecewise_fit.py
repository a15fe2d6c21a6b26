"""The joint fit on exact outlines of a body that bounces: everything comes back, the time of impact between frames included."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera
from estimator.appearance.flight_errors import errors_of
from estimator.data.fit_task import FitTask, Prior, Sightings
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.problem import Problem, alone, prior_of
from estimator.fitting.trajectory import cost, equations, fit
from estimator.fitting.weighed_tangencies import Refinement
from estimator.impacts.loose_contact import loosened
from estimator.impacts.piecewise_fit import refine_piecewise, widened_by
from estimator.impacts.segments import joined, meeting_time, reversed_turns, segment_rows
from estimator.motion.flight import OMEGA, THETA, V, X, flown
from estimator.motion.piecewise import Bounce, PiecewiseFlight
from estimator.search.flight_starts import at_time
from tests.estimator.exact import HSV, ellipsoid_outline, ellipsoid_views, exact_silhouettes, rig
from tests.estimator.fitting.test_within_sequence import SEMI_AXES, spinning

Array = NDArray[np.float64]
FRAMES, IMPACT_S = 25, 0.00437
TIMES = np.linspace(0.0, 0.008, FRAMES)
SETTINGS = Refinement(floor_px=0.04, body_noise_px=0.05, within_pairs=100)


def bouncing() -> PiecewiseFlight:
    return PiecewiseFlight(
        replace(spinning(), time_s=0.002), (Bounce(IMPACT_S, np.array([0.7, 0.9, -0.2]), np.array([-210.0, 60.0, 250.0])),)
    )


def seen(flight: PiecewiseFlight) -> FitTask:
    """Exact outlines in one camera."""
    camera = HsvCamera("front", HSV, np.eye(3), np.zeros(3))
    at = flown(flight, TIMES)
    rings = [ellipsoid_outline(SEMI_AXES, HSV, (R, c)) for R, c in zip(at.R[:, 0], at.centre[:, 0], strict=True)]
    sightings = Sightings(exact_silhouettes(rings, [HSV] * FRAMES), np.zeros(FRAMES, dtype=np.int64), np.arange(FRAMES), TIMES, (camera,))
    views = ellipsoid_views(SEMI_AXES, rig(3))
    return FitTask(sightings, views, Prior(1e-5, 0.02, 0.005, 0.02), np.inf, np.ones((FRAMES, len(views.silhouettes))))


def away() -> Array:
    """A step off the truth: a millimetre in depth, degrees, per cents of the velocities, and two tenths of a frame."""
    step = np.zeros(28)
    step[X], step[THETA], step[V], step[OMEGA] = [2e-4, -2e-4, 1e-3], 0.03, 0.02, 4.0
    step[21:] = [7e-5, 0.02, -0.02, 0.03, 5.0, -4.0, 3.0]
    return step


def test_a_bounce_is_recovered_from_exact_outlines() -> None:
    truth = bouncing()
    found = fit(seen(truth), truth.moved(away()), max_steps=40, tolerance=1e-9).state
    bounce, true = found.bounces[0], truth.bounces[0]
    assert abs(bounce.time_s - true.time_s) < 1e-3 * (TIMES[1] - TIMES[0])
    assert np.abs(bounce.v - true.v)[:2].max() < 2e-3 * np.linalg.norm(true.v)
    assert np.linalg.norm(bounce.omega - true.omega) < 2e-3 * np.linalg.norm(true.omega)
    assert np.linalg.norm(found.first.omega - truth.first.omega) < 2e-3 * np.linalg.norm(truth.first.omega)


def plain_cost(task: FitTask, flight: PiecewiseFlight) -> float:
    """Without the factor for pairs that have no tangent planes, which is no part of the gradient."""
    return float(errors_of(task, flight.first, flown(flight, TIMES)).cost.sum()) + prior_of(alone(task, flight), flight).cost


def test_the_gradient_is_that_of_the_cost() -> None:
    """By the time of impact too, against central differences of the cost."""
    truth = bouncing()
    task, flight = seen(truth), truth.moved(0.02 * away())
    problem: Problem[PiecewiseFlight, PiecewiseFlight, NormalEquations] = Problem(alone(task, flight), equations)
    found = problem.at(flight)
    for column, width in ((0, 1e-7), (4, 1e-6), (7, 1e-5), (10, 1e-3), (21, 1e-8), (23, 1e-5), (26, 1e-3)):
        step = np.zeros(flight.size)
        step[column] = width
        slope = (plain_cost(task, flight.moved(step)) - plain_cost(task, flight.moved(-step))) / (2.0 * width)
        assert abs(slope - found.g[column]) < 2e-3 * np.sqrt(2.0 * found.cost * found.H[column, column])


def test_the_covariance_knows_what_goes_through_the_impact() -> None:
    """With the pose shared, the spin before the impact is known better than from its own frames alone; the time has an error bar."""
    truth = bouncing()
    task = seen(truth)
    refined = refine_piecewise(replace(task, huber=4.0), truth, SETTINGS)
    assert refined.settled
    sigma = np.sqrt(np.diag(refined.covariance))
    assert sigma.shape == (28,)
    assert 0.0 < sigma[21] < 0.1 * (TIMES[1] - TIMES[0])
    assert np.all(np.linalg.eigvalsh(refined.covariance) > 0.0)
    assert abs(refined.flight.bounces[0].time_s - IMPACT_S) < 3.0 * sigma[21]


def test_separate_flights_meet_where_the_impact_was() -> None:
    truth = bouncing()
    bounce = truth.bounces[0]
    there = flown(truth, np.array([IMPACT_S])).centre[0, 0]
    after = replace(truth.first, time_s=IMPACT_S, x=there + np.array([0.0, 0.0, 2e-3]), v=bounce.v, omega=bounce.omega)
    viewing = np.array([0.0, 0.0, 1.0])
    met = meeting_time(truth.first, after, IMPACT_S + 2e-4, viewing)
    assert abs(met - IMPACT_S) < 5e-6
    chain = joined([truth.first, after], [met], 0.001)
    assert chain.first.time_s == 0.001
    np.testing.assert_allclose(flown(chain, TIMES).centre, flown(truth, TIMES).centre, atol=1e-5)


def test_rows_beside_an_impact_belong_to_no_segment() -> None:
    rows = segment_rows(np.arange(8.0), np.array([3.4, 6.0]), clear_s=0.5)
    assert [r.tolist() for r in rows] == [[0, 1, 2], [4, 5], [7]]


def test_a_bounce_that_cannot_be_flown_costs_more_than_any_other() -> None:
    truth = bouncing()
    runaway = replace(truth, bounces=(replace(truth.bounces[0], omega=np.full(3, 1e7)),))
    assert cost(seen(truth), runaway) == np.inf


def test_slow_turns_are_reversed_across_the_line_of_sight_and_fast_ones_are_not() -> None:
    """About the pose at the impact; what turns about the line of sight is seen, and stays."""
    viewing = np.array([0.0, 0.0, 1.0])
    slow = replace(bouncing(), first=replace(spinning(), time_s=0.002, omega=np.array([9.0, -4.0, 300.0])))
    (other,) = reversed_turns(slow, (0.0, 0.008), viewing)
    before, after = (flown(f, np.array([IMPACT_S])) for f in (slow, other))
    np.testing.assert_allclose(after.R, before.R, atol=1e-6)
    np.testing.assert_allclose(after.centre, before.centre, atol=1e-9)
    spin, turned = (at_time(f.first, IMPACT_S).omega for f in (slow, other))
    np.testing.assert_allclose(turned, spin * [-1.0, -1.0, 1.0], atol=1e-3)
    assert other.bounces == slow.bounces
    assert reversed_turns(bouncing(), (0.0, 0.008), viewing) == []
    late = PiecewiseFlight(slow.first, (Bounce(IMPACT_S, np.zeros(3), np.array([5.0, 6.0, 7.0])),))
    first, last = reversed_turns(late, (0.0, 0.008), viewing)
    assert first.bounces == late.bounces
    assert last.first == late.first
    np.testing.assert_allclose(last.bounces[0].omega, [-5.0, -6.0, 7.0])


def test_intervals_that_allow_for_several_contacts_hold_the_way_to_them() -> None:
    """The flight stays; the further its pose after the impact is from where its pictures have it, the wider are the intervals."""
    truth = bouncing()
    task = seen(truth)
    held = refine_piecewise(task, truth, SETTINGS)
    loose = loosened(truth, 0, 1e-4)
    (bounce,) = loose.bounces
    assert bounce.loose is not None
    wide = widened_by(task, held, SETTINGS, loose)
    assert wide.flight == held.flight
    assert wide.settled
    assert np.all(np.diag(wide.covariance)[21:] > np.diag(held.covariance)[21:])
    shifted = replace(truth, bounces=(replace(truth.bounces[0], shift=bounce.loose.basis @ np.array([1e-4, 0.0, 0.0, 0.0, 0.0])),))
    off = widened_by(seen(shifted), held, SETTINGS, loose)
    assert np.all(np.diag(off.covariance)[21:] > 4.0 * np.diag(wide.covariance)[21:])
