"""Pairs within the sequence: gradient and normal matrix of one visible cost, by central differences.

With a noise floor far above every error all pairs weigh the same and the cost is ``sightings * rms² / floor²`` times the share of pairs
that are used, so gradient and curvature can be compared with what the RMS alone does.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import HsvCamera
from estimator.data.fit_task import FitTask, Prior, Sightings, restricted
from estimator.fitting.trajectory import fit
from estimator.fitting.weighed_tangencies import pose_map
from estimator.fitting.within_sequence import WithinEquations, within_equations
from estimator.motion.flight import COM, N_PARAMETERS, Flight, moved, poses, poses_and_sensitivity
from tests.estimator.exact import HSV, ellipsoid_moments, ellipsoid_outline, ellipsoid_views, exact_silhouettes, rig

Array = NDArray[np.float64]
SEMI_AXES = np.array([1.9e-3, 2.5e-3, 3.2e-3])[::-1].copy()
FRAMES, FLOOR_PX = 12, 1e3
UNITS = np.array([1e-5] * 3 + [1e-3] * 3 + [1e-2] * 3 + [0.3] * 3 + [1e-5] * 3 + [3e-3] * 5 + [0.05])
"""A step of each parameter that moves outlines by about a tenth of a pixel."""


def spinning() -> Flight:
    return Flight(
        time_s=0.004,
        x=np.array([2e-3, -3e-3, 0.6]),
        q=np.array([0.1, -0.4, 0.3, 0.86]) / np.linalg.norm([0.1, -0.4, 0.3, 0.86]),
        v=np.array([1.2, -0.8, 0.4]),
        omega=np.array([90.0, -140.0, 60.0]),
        body=Body(np.zeros(3), np.eye(3), ellipsoid_moments(SEMI_AXES)),
        com=np.zeros(3),
        inertia=np.zeros(5),
        offset_px=0.0,
        gravity_world=np.array([0.0, 9.81, 0.0]),
    )


@pytest.fixture(scope="module")
def task() -> FitTask:
    """Exact outlines of an ellipsoid in flight, seen by two cameras."""
    return seen_by_two(spinning())


def seen_by_two(flight: Flight) -> FitTask:
    turn = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    cameras = (
        HsvCamera("front", HSV, np.eye(3), np.zeros(3)),
        HsvCamera("side", HSV, turn, np.array([0.0, 0.0, 0.6]) - turn @ np.array([0.0, 0.0, 0.6])),
    )
    times = np.linspace(0.0, 0.008, FRAMES)
    flown = poses(flight, np.zeros((1, N_PARAMETERS)), times)
    rings, camera = [], np.repeat([0, 1], FRAMES)
    for c, f in zip(camera, np.tile(np.arange(FRAMES), 2), strict=True):
        R = cameras[c].R_cam_world @ flown.R[f, 0]
        rings.append(ellipsoid_outline(SEMI_AXES, HSV, (R, cameras[c].R_cam_world @ flown.centre[f, 0] + cameras[c].t_cam_world)))
    sightings = Sightings(exact_silhouettes(rings, [HSV] * len(rings)), camera, np.tile(np.arange(FRAMES), 2), np.tile(times, 2), cameras)
    views = ellipsoid_views(SEMI_AXES, rig(3))
    return FitTask(sightings, views, Prior(1e-5, 0.02, 0.005, 0.02), np.inf, np.ones((len(rings), len(views.silhouettes))))


def equations(task: FitTask, flight: Flight) -> WithinEquations:
    predicted, sensitivity = poses_and_sensitivity(flight, task.sightings.times_s)
    return within_equations(task, flight, predicted, pose_map(sensitivity), most_pairs=10_000, floor_px=FLOOR_PX)


def cost(task: FitTask, flight: Flight) -> float:
    at = equations(task, flight)
    n = len(task.sightings)
    return at.pairs / (n * (n - 1) / 2) * n * at.rms_px**2 / FLOOR_PX**2


def test_true_flight_has_no_error_within_the_sequence(task: FitTask) -> None:
    at = equations(task, spinning())
    assert at.pairs > 0.8 * len(task.sightings) * (len(task.sightings) - 1) / 2
    assert at.rms_px < 0.01


@pytest.mark.parametrize(("offset_px", "tolerance"), [(0.0, 5e-5), (0.3, 1e-3)])
def test_the_gradient_is_that_of_the_cost(task: FitTask, offset_px: float, tolerance: float) -> None:
    """Within ``tolerance`` of the largest gradient possible at this cost; with an offset, its change with the pose is left out."""
    rng = np.random.default_rng(3)
    flight = replace(moved(spinning(), rng.normal(size=N_PARAMETERS) * UNITS), offset_px=offset_px)
    at = equations(task, flight)
    numeric = np.empty(N_PARAMETERS)
    for k in range(N_PARAMETERS):
        step = np.zeros(N_PARAMETERS)
        step[k] = 0.01 * UNITS[k]
        numeric[k] = (cost(task, moved(flight, step)) - cost(task, moved(flight, -step))) / (2.0 * step[k])
    # Cauchy-Schwarz: no residuals of this size can have a gradient above sqrt(H_kk 2 cost).
    largest = np.sqrt(np.diag(at.H) * 2.0 * cost(task, flight))
    free = np.delete(np.arange(N_PARAMETERS), COM)
    assert np.all(np.abs(at.g - numeric)[free] < tolerance * largest[free])
    assert np.sum(np.abs(numeric)[free] > 20.0 * tolerance * largest[free]) >= 8


def test_without_views_the_place_of_the_centre_in_the_body_is_not_seen(task: FitTask) -> None:
    """Moving the centre of mass within the body while it keeps its path only names the body's points anew."""
    at = equations(task, moved(spinning(), 0.5 * UNITS))
    seen = np.diag(at.H) * UNITS**2
    assert seen[COM].max() < 1e-12 * seen[:12].max()


def test_the_normal_matrix_is_the_curvature_where_there_is_no_error(task: FitTask) -> None:
    H = equations(task, spinning()).H
    rng = np.random.default_rng(4)
    np.testing.assert_allclose(H, H.T, rtol=1e-9, atol=1e-12 * np.abs(H).max())
    for _ in range(4):
        step = 0.3 * rng.normal(size=N_PARAMETERS) * UNITS
        both = cost(task, moved(spinning(), step)) + cost(task, moved(spinning(), -step))
        assert step @ H @ step == pytest.approx(both, rel=1e-3)


def test_pairs_are_limited_and_together_weigh_as_one_pair_a_sighting(task: FitTask) -> None:
    predicted, sensitivity = poses_and_sensitivity(spinning(), task.sightings.times_s)
    S = pose_map(sensitivity)
    every, few = (within_equations(task, spinning(), predicted, S, most_pairs=most, floor_px=FLOOR_PX) for most in (10_000, 40))
    assert few.pairs <= 40 < every.pairs
    ratio = np.diag(few.H)[:12] / np.diag(every.H)[:12]
    assert np.all((ratio > 0.4) & (ratio < 2.5))
    none = within_equations(task, spinning(), predicted, S, most_pairs=0, floor_px=FLOOR_PX)
    assert (none.pairs, none.rms_px) == (0, 0.0)
    assert not none.H.any()
    assert not none.g.any()


def test_nearly_the_same_side_seen_twice_is_no_pair() -> None:
    """A body that hardly turns: only the two cameras, at a right angle, make pairs, and each camera's sightings alone make none."""
    slow = replace(spinning(), omega=np.array([0.5, -0.8, 0.3]))
    both = seen_by_two(slow)
    assert equations(both, slow).pairs == FRAMES**2
    alone = equations(restricted(both, np.flatnonzero(both.sightings.camera == 0)), slow)
    assert (alone.pairs, alone.rms_px) == (0, 0.0)
    assert not alone.H.any()


def test_opposite_sides_are_no_pair() -> None:
    """Half a turn about a line across the camera's: first and last see opposite sides, first and middle do not."""
    half = replace(spinning(), omega=np.array([0.0, np.pi / 0.008, 0.0]), v=np.zeros(3), body=Body(np.zeros(3), np.eye(3), np.ones(3)))
    ends = restricted(seen_by_two(half), np.array([0, FRAMES - 1]))
    assert equations(ends, half).pairs == 0
    quarter = restricted(seen_by_two(half), np.array([0, FRAMES // 2]))
    assert equations(quarter, half).pairs == 1


def test_the_trajectory_fits_normal_matrix_is_its_curvature(task: FitTask) -> None:
    at = fit(task, spinning(), max_steps=0).equations
    rng = np.random.default_rng(5)
    for _ in range(4):
        step = 0.2 * rng.normal(size=N_PARAMETERS) * UNITS
        costs = [fit(task, moved(spinning(), sign * step), max_steps=0).equations.cost for sign in (1.0, -1.0)]
        assert step @ at.H @ step == pytest.approx(sum(costs) - 2.0 * at.cost, rel=5e-3)


def test_the_trajectory_fit_comes_back(task: FitTask) -> None:
    away = moved(spinning(), np.random.default_rng(6).normal(size=N_PARAMETERS) * UNITS * ([3.0] * 12 + [0.0] * 9))
    back = fit(task, away).state
    np.testing.assert_allclose(back.v, spinning().v, atol=1e-3)
    np.testing.assert_allclose(back.omega, spinning().omega, atol=0.05)
    np.testing.assert_allclose(back.x, spinning().x, atol=2e-6)
    assert abs(back.offset_px) < 5e-3
