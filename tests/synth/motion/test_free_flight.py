"""Free flight keeps what physics keeps, and arrives where an independent integration arrived."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from synth.motion import FreeFlight, Start, fly

MOMENTS = np.array([1e-9, 2e-9, 3e-9])
GRAVITY = np.array([0.3, 9.8, -0.2])


def flight(omega_body: tuple[float, float, float], seed: int, *, latest_s: float = 0.025) -> FreeFlight:
    rng = np.random.default_rng(seed)
    q = Rotation.random(rng=rng)
    start = Start(rng.normal(size=3), q.as_quat(), rng.normal(size=3), q.apply(omega_body))
    return fly(start, MOMENTS, GRAVITY, earliest_s=-0.005, latest_s=latest_s)


@pytest.mark.parametrize(
    ("omega", "expected"),
    [((1, 100, 1), (-1.22762865, 99.99746461, 1.08121415)), ((30, 90, -20), (88.68903641, 33.67869980, -52.17197581))],
)
def test_angular_velocity_of_the_reference_integrations(omega: tuple[float, float, float], expected: tuple[float, float, float]) -> None:
    end = flight(omega, seed=1).at(np.array([0.025]))
    omega_body = Rotation.from_quat(end.q_world_body).inv().apply(end.omega_world)
    # The reference numbers have eight decimals.
    np.testing.assert_allclose(omega_body[0], expected, atol=6e-9)


@pytest.mark.parametrize("seed", range(4))
def test_energy_and_angular_momentum_are_kept_to_1e_12(seed: int) -> None:
    motion = flight((120.0, -220.0, 150.0), seed).at(np.linspace(-0.005, 0.025, 301))
    q = Rotation.from_quat(motion.q_world_body)
    omega_body = q.inv().apply(motion.omega_world)
    L_world = q.apply(MOMENTS * omega_body)
    energy = np.sum(MOMENTS * omega_body**2, axis=1)
    assert np.abs(L_world - L_world[0]).max() < 1e-12 * np.linalg.norm(L_world[0])
    assert np.ptp(energy) < 1e-12 * energy[0]


def test_a_long_flight_keeps_them_too() -> None:
    motion = flight((120.0, -220.0, 150.0), 7, latest_s=0.5).at(np.linspace(0, 0.5, 500))
    q = Rotation.from_quat(motion.q_world_body)
    L_world = q.apply(MOMENTS * q.inv().apply(motion.omega_world))
    assert np.abs(L_world - L_world[0]).max() < 2e-11 * np.linalg.norm(L_world[0])


def test_orientation_turns_at_the_angular_velocity() -> None:
    step = 1e-6
    middle = 0.0123
    motion = flight((30.0, 90.0, -20.0), 3).at(np.array([middle - step, middle, middle + step]))
    q = Rotation.from_quat(motion.q_world_body)
    turned = (q[2] * q[0].inv()).as_rotvec() / (2 * step)
    # The central difference errs by step² |ω''| / 6, about 1e-6; rounding by 1e-16 / step.
    np.testing.assert_allclose(turned, motion.omega_world[1], atol=1e-5)


def test_centre_of_mass_is_accelerated_by_gravity_and_moves_at_its_velocity() -> None:
    t = np.array([0.0, 0.01, 0.02])
    motion = flight((1.0, 2.0, 3.0), 4).at(t)
    np.testing.assert_allclose((motion.x_world[2] - 2 * motion.x_world[1] + motion.x_world[0]) / 0.01**2, GRAVITY, atol=1e-10)
    np.testing.assert_allclose((motion.x_world[2] - motion.x_world[0]) / 0.02, motion.v_world[1], atol=1e-12)


def test_no_spin_means_no_turning() -> None:
    motion = flight((0.0, 0.0, 0.0), 5).at(np.linspace(0, 0.025, 5))
    np.testing.assert_allclose(motion.q_world_body, np.tile(motion.q_world_body[0], (5, 1)), atol=1e-15)


def test_a_common_factor_of_the_moments_does_not_matter() -> None:
    q = Rotation.random(rng=np.random.default_rng(6)).as_quat()
    start = Start(np.zeros(3), q, np.zeros(3), np.array([50.0, 20.0, 90.0]))
    a, b = (fly(start, MOMENTS * factor, GRAVITY, earliest_s=0.0, latest_s=0.02).at(np.array([0.02])) for factor in (1.0, 1e9))
    np.testing.assert_allclose(a.q_world_body, b.q_world_body, atol=1e-13)


def test_a_time_outside_the_span_is_refused() -> None:
    with pytest.raises(ValueError, match="asked for"):
        flight((1.0, 2.0, 3.0), 8).at(np.array([0.03]))
