"""Free flight: reference numbers, conservation, and sensitivities against differences."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.vocabulary.body import Body
from estimator.motion.flight import (
    N_PARAMETERS,
    OFFSET,
    Flight,
    fitted_body,
    inertia_matrix,
    moved,
    poses,
    poses_and_sensitivity,
    states,
    velocities,
    velocity_sensitivity,
)
from estimator.motion.rigid_body import (
    RanAway,
    States,
    angular_momentum,
    angular_velocity,
    cross_product,
    fall,
    propagate,
    rotation_matrices,
)

Array = NDArray[np.float64]
TIMES = np.linspace(0.0, 0.025, 101)


@pytest.fixture
def flight() -> Flight:
    body = Body(np.array([1e-4, 2e-4, -1e-4]), Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix(), np.array([0.45, 0.8, 1.0]))
    return Flight(
        time_s=0.0125,
        x=np.array([0.01, -0.02, 0.6]),
        q=Rotation.from_rotvec([0.4, 0.1, -0.7]).as_quat(),
        v=np.array([1.2, -0.6, 0.8]),
        omega=np.array([120.0, -90.0, 60.0]),
        body=body,
        com=np.array([1e-5, -2e-5, 1.5e-5]),
        inertia=np.array([0.01, -0.02, 0.005, 0.01, -0.004]),
        offset_px=0.05,
        gravity_world=np.array([0.0, 9.81, 0.0]),
    )


@pytest.mark.parametrize(
    ("start", "end"),
    [((1.0, 100.0, 1.0), (-1.22762865, 99.99746461, 1.08121415)), ((30.0, 90.0, -20.0), (88.68903641, 33.67869980, -52.17197581))],
)
def test_free_rotation_matches_the_reference(start: tuple[float, ...], end: tuple[float, ...]) -> None:
    inertia = np.diag([1.0, 2.0, 3.0])[None] / 3.0
    q, omega = np.array([[0.0, 0.0, 0.0, 1.0]]), np.array([start])
    begin = States(np.zeros((1, 3)), q, np.zeros((1, 3)), angular_momentum(q, omega, inertia))
    fine = np.linspace(0.0, 0.025, 1001)
    reached = propagate(begin, np.linalg.inv(inertia), fine, start_time_s=0.0, acceleration=lambda _t, s, _w: np.zeros_like(s.x))
    body = rotation_matrices(reached.q[-1])[0].T @ angular_velocity(reached.q[-1], reached.L[-1], np.linalg.inv(inertia))[0]
    np.testing.assert_allclose(body, end, atol=1e-8)


@pytest.mark.parametrize("start_s", [-0.001, 0.0, 0.0101, 0.03])
def test_falling_is_what_propagation_under_gravity_alone_does(start_s: float) -> None:
    """Forwards and backwards, with flights side by side that need several steps a frame."""
    rng, gravity = np.random.default_rng(0), np.array([0.3, -9.81, 0.1])
    q = rng.normal(size=(7, 4))
    begin = States(
        rng.normal(size=(7, 3)), q / np.linalg.norm(q, axis=1, keepdims=True), rng.normal(size=(7, 3)), 600.0 * rng.normal(size=(7, 3))
    )
    inverse = np.tile(np.diag([2.0, 1.5, 1.0]), (7, 1, 1))
    fallen = fall(begin, inverse, TIMES, start_time_s=start_s, gravity=gravity)
    reached = propagate(begin, inverse, TIMES, start_time_s=start_s, acceleration=lambda _t, s, _w: np.broadcast_to(gravity, s.x.shape))
    for name in ("x", "q", "v", "L"):
        np.testing.assert_allclose(getattr(fallen, name), getattr(reached, name), atol=1e-12)


def test_a_fall_that_runs_away_is_refused() -> None:
    begin = States(np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]]), np.zeros((1, 3)), np.array([[np.nan, 0.0, 0.0]]))
    with pytest.raises(RanAway):
        fall(begin, np.eye(3)[None], TIMES, start_time_s=0.0, gravity=np.zeros(3))


@pytest.mark.parametrize("excess", [1e-4, 1e-6, 1e-8])
def test_a_flight_that_runs_away_within_its_last_interval_is_refused(flight: Flight, excess: float) -> None:
    """Its spin at the start of the interval is none too fast, but its inertia is nearly singular."""
    odd = replace(flight, omega=np.array([10.0, 200.0, 30.0]), inertia=np.array([-1.0 - excess, 0.0, 0.0, 0.0, 0.0]))
    with pytest.raises(RanAway, match="its attitude is no number"):
        states(odd, np.zeros((1, N_PARAMETERS)), np.array([odd.time_s + 2e-3]))


def test_an_inertia_without_inverse_is_refused(flight: Flight) -> None:
    flat = replace(flight, inertia=np.array([-1.0, 0.0, 0.0, 0.0, 0.0]))
    with pytest.raises(RanAway, match="its inertia has no inverse"):
        states(flat, np.zeros((1, N_PARAMETERS)), np.array([flat.time_s]))


def test_times_that_are_no_numbers_are_refused(flight: Flight) -> None:
    with pytest.raises(RanAway):
        states(flight, np.zeros((1, N_PARAMETERS)), np.array([flight.time_s, np.nan]))


def test_a_spin_that_rows_cannot_follow_ran_away() -> None:
    """Rows of a gyroscope are 10 ms apart: its steps would go on for minutes."""
    begin = States(np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]]), np.zeros((1, 3)), np.array([[0.0, 5e4, 0.0]]))
    with pytest.raises(RanAway, match="it spins with 50000 rad/s"):
        propagate(begin, np.eye(3)[None], 0.01 * np.arange(50), start_time_s=0.0, acceleration=lambda _t, s, _w: np.zeros_like(s.x))


def test_one_step_a_frame_is_enough(flight: Flight) -> None:
    fine = np.linspace(0.0, 0.025, 1001)
    coarse = states(flight, np.zeros((1, N_PARAMETERS)), TIMES)
    exact = states(flight, np.zeros((1, N_PARAMETERS)), fine)
    assert np.abs(coarse.q[-1] - exact.q[-1]).max() < 1e-6


def test_energy_and_fall(flight: Flight) -> None:
    reached = states(flight, np.zeros((1, N_PARAMETERS)), TIMES)
    inertia = inertia_matrix(flight, flight.inertia[None])
    omega = np.stack([angular_velocity(q, L, np.linalg.inv(inertia))[0] for q, L in zip(reached.q, reached.L, strict=True)])
    energy = 0.5 * np.sum(omega * reached.L[:, 0], axis=1)
    assert np.ptp(energy) < 1e-6 * energy[0]
    t = TIMES - flight.time_s
    fallen = flight.x + flight.v * t[:, None] + 0.5 * flight.gravity_world * (t**2)[:, None]
    np.testing.assert_allclose(reached.x[:, 0], fallen, atol=1e-12)


def test_pose_sensitivity_is_the_derivative_along_a_step(flight: Flight) -> None:
    rng = np.random.default_rng(0)
    scale = np.array([1e-4] * 3 + [1e-3] * 3 + [1e-2] * 3 + [0.1] * 3 + [1e-5] * 3 + [1e-3] * 5 + [0.1])
    step = rng.normal(size=N_PARAMETERS) * scale
    at, S = poses_and_sensitivity(flight, TIMES)
    half = 0.05
    plus, minus = (
        poses(moved(flight, half * step), np.zeros((1, N_PARAMETERS)), TIMES),
        poses(moved(flight, -half * step), np.zeros((1, N_PARAMETERS)), TIMES),
    )
    centre = (plus.centre - minus.centre)[:, 0] / (2 * half)
    turned = Rotation.from_matrix(plus.R[:, 0] @ np.swapaxes(minus.R[:, 0], 1, 2)).as_rotvec() / (2 * half)
    np.testing.assert_allclose(S[:, :3] @ step, centre, atol=2e-5 * np.abs(centre).max())
    np.testing.assert_allclose(S[:, 3:] @ step, turned, atol=2e-5 * np.abs(turned).max())
    assert not S[:, :, OFFSET].any()
    assert at.R.shape == (101, 1, 3, 3)


def test_velocity_sensitivity_is_the_derivative(flight: Flight) -> None:
    J = velocity_sensitivity(flight, 0.0)
    rng = np.random.default_rng(1)
    step = rng.normal(size=N_PARAMETERS) * np.array([1e-4] * 3 + [1e-3] * 3 + [1e-2] * 3 + [0.1] * 3 + [1e-5] * 3 + [1e-3] * 5 + [0.1])
    half = 0.05
    v1, w1 = velocities(moved(flight, half * step), np.zeros((1, N_PARAMETERS)), 0.0)
    v0, w0 = velocities(moved(flight, -half * step), np.zeros((1, N_PARAMETERS)), 0.0)
    expected = np.concatenate([v1[0] - v0[0], w1[0] - w0[0]]) / (2 * half)
    np.testing.assert_allclose(J @ step, expected, atol=2e-5 * np.abs(expected).max())


def test_fitted_body_carries_the_shift_and_the_new_axes(flight: Flight) -> None:
    body = fitted_body(flight)
    np.testing.assert_allclose(body.com_particle - flight.body.com_particle, flight.body.R_particle_body @ flight.com, atol=1e-15)
    relative = flight.body.R_particle_body.T @ body.R_particle_body
    J = inertia_matrix(flight, flight.inertia[None])[0]
    diagonal = relative.T @ J @ relative
    np.testing.assert_allclose(diagonal, np.diag(np.diag(diagonal)), atol=1e-12)
    np.testing.assert_allclose(np.diag(diagonal) / diagonal[2, 2], body.inertia_ratios, atol=1e-12)
    assert np.linalg.det(body.R_particle_body) == pytest.approx(1.0)


def test_the_compiled_product_is_that_of_numpy() -> None:
    """To the last bit, of rows that do not lie side by side, too."""
    a, b = np.random.default_rng(5).normal(size=(2, 7, 6))[:, :, ::2]
    assert np.array_equal(cross_product(a, b), np.cross(a, b))
