"""Forces and torques against closed solutions and conservation laws."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from synth.motion import fly

TIMES = np.linspace(0, 0.03, 13)
GRAVITY = np.array([0.0, 9.80665, 0.0])


def momentum(motion, ratios: np.ndarray) -> np.ndarray:
    """Angular momentum over the largest moment, world frame."""
    R = Rotation.from_quat(motion.q_world_body)
    return np.asarray(R.apply(ratios * R.inv().apply(motion.omega_world)))


def test_without_a_push_it_is_free_flight(flown, start, body) -> None:
    pushed = flown("gravity", gravity=GRAVITY, dg_x=1e-300).at(TIMES)
    free = fly(start, body.inertia_kgm2, GRAVITY, earliest_s=-1e-3, latest_s=0.03).at(TIMES)
    np.testing.assert_allclose(pushed.x_world, free.x_world, atol=1e-13)
    np.testing.assert_allclose(pushed.q_world_body, free.q_world_body, atol=1e-11)
    np.testing.assert_allclose(pushed.omega_world, free.omega_world, rtol=1e-10)


@pytest.mark.parametrize(("key", "names"), [("gravity", ("dg_x", "dg_y", "dg_z")), ("uniform_acceleration", ("a_x", "a_y", "a_z"))])
def test_a_constant_acceleration(flown, start, key: str, names: tuple[str, ...]) -> None:
    added = np.array([0.3, -0.2, 0.1])
    motion = flown(key, gravity=GRAVITY, **dict(zip(names, added, strict=True))).at(TIMES)
    t = TIMES[:, None]
    np.testing.assert_allclose(motion.x_world, start.x_world + start.v_world * t + 0.5 * (GRAVITY + added) * t**2, atol=1e-13)


def test_linear_drag_decays_exponentially(flown, start) -> None:
    motion = flown("linear_drag", gravity=GRAVITY, rate=8.0).at(TIMES)
    left, t = np.exp(-8.0 * TIMES)[:, None], TIMES[:, None]
    np.testing.assert_allclose(motion.v_world, start.v_world * left + GRAVITY / 8.0 * (1 - left), atol=1e-12)
    path = start.v_world / 8.0 * (1 - left) + GRAVITY / 8.0 * (t - (1 - left) / 8.0)
    np.testing.assert_allclose(motion.x_world - start.x_world, path, atol=1e-12)


def test_quadratic_drag_takes_speed_and_keeps_direction(flown, start) -> None:
    motion = flown("quadratic_drag", per_length=2.0).at(TIMES)
    v0 = np.linalg.norm(start.v_world)
    np.testing.assert_allclose(np.linalg.norm(motion.v_world, axis=1), v0 / (1 + 2.0 * v0 * TIMES), rtol=1e-12)
    np.testing.assert_allclose(np.cross(motion.v_world, start.v_world), 0, atol=1e-13)


def test_magnus_lift_does_no_work_and_turns_about_the_spin(flown, start) -> None:
    """On a body with equal moments the spin is constant, and the velocity turns about it at ``coefficient`` times its rate."""
    motion = flown("magnus_lift", moments=np.full(3, 2e-9), coefficient=0.3).at(TIMES)
    turned = np.array([Rotation.from_rotvec(0.3 * start.omega_world * t).apply(start.v_world) for t in TIMES])
    np.testing.assert_allclose(motion.v_world, turned, atol=1e-12)
    tumbling = flown("magnus_lift", coefficient=0.3).at(TIMES)
    np.testing.assert_allclose(np.linalg.norm(tumbling.v_world, axis=1), np.linalg.norm(start.v_world), rtol=1e-12)


def test_spin_damping_halves_momentum_and_keeps_its_direction(flown, body) -> None:
    rate = np.log(2) / 0.02
    motion = flown("spin_damping", rate=rate).at(np.array([0.0, 0.01, 0.02, 0.03]))
    L = momentum(motion, body.body.inertia_ratios)
    np.testing.assert_allclose(L, L[0] * (0.5 ** (np.arange(4) / 2))[:, None], rtol=1e-10)
    assert np.ptp(motion.v_world, axis=0).max() == 0


def test_a_small_wobble_of_a_symmetric_body_decays_at_the_rate_of_the_catalogue(flown) -> None:
    """``I1 = I2``: the spin across the axis of ``I3`` falls with ``rate (I3 - I1) / I1``, the size of the momentum stays."""
    moments, rate = np.array([2.0e-9, 2.0e-9, 4e-9]), 10.0
    motion = flown("nutation_damping", moments=moments, rate=rate).at(TIMES)
    ratios = moments / moments.max()
    np.testing.assert_allclose(np.linalg.norm(momentum(motion, ratios), axis=1), np.linalg.norm(momentum(motion, ratios)[0]), rtol=1e-9)
    spin = Rotation.from_quat(motion.q_world_body).inv().apply(motion.omega_world)
    # d tan(nutation) / dt = -rate (I3 - I1) / I1 tan(nutation): exact for every angle of a symmetric body.
    wobble = np.linalg.norm(spin[:, :2], axis=1) / np.abs(spin[:, 2])
    np.testing.assert_allclose(np.log(wobble / wobble[0]), -rate * TIMES, rtol=1e-6, atol=1e-9)


def test_a_wall_pulls_along_its_normal_and_conserves_energy(flown, start) -> None:
    normal = np.array([3.0, 0.0, 4.0])
    values = {"strength": 1e-3, "normal_x": 3.0, "normal_y": 0.0, "normal_z": 4.0, "position": 0.45}
    motion = flown("wall_attraction", **values).at(TIMES)
    distance = motion.x_world @ normal / 5 - 0.45
    energy = 0.5 * (motion.v_world**2).sum(axis=1) - 1e-3 / distance
    np.testing.assert_allclose(energy, energy[0], rtol=1e-12)
    along = np.array([4.0, 0.0, -3.0]) / 5
    np.testing.assert_allclose(motion.v_world @ along, start.v_world @ along, atol=1e-13)
    assert (motion.v_world @ normal)[-1] < (start.v_world @ normal)


def test_a_wall_behind_the_flight_and_one_without_direction(flown) -> None:
    with pytest.raises(InputError, match="expected a flight on the room's side of the wall"):
        flown("wall_attraction", strength=1e-3, normal_x=0.0, normal_y=0.0, normal_z=1.0, position=0.7)
    with pytest.raises(InputError, match="a normal of some length"):
        flown("wall_attraction", strength=1e-3)


def test_thrust_through_the_centre_of_mass_turns_nothing(flown, start, body) -> None:
    motion = flown("outgassing_thrust", a1=2.0).at(TIMES)
    free = fly(start, body.inertia_kgm2, np.zeros(3), earliest_s=-1e-3, latest_s=0.03).at(TIMES)
    np.testing.assert_allclose(motion.omega_world, free.omega_world, rtol=1e-10)
    h = 1e-4
    around = flown("outgassing_thrust", a1=2.0).at(np.array([0.01 - h, 0.01, 0.01 + h]))
    acceleration = (around.v_world[2] - around.v_world[0]) / (2 * h)
    axis = Rotation.from_quat(around.q_world_body[1]).as_matrix()[:, 0]
    np.testing.assert_allclose(acceleration, 2.0 * axis, atol=2e-4)


def test_thrust_beside_the_centre_of_mass_is_a_torque(flown, body) -> None:
    """``dL/dt = R (m arm x a)``, by central differences; their error is ``h² / 6`` times the third derivative of L."""
    h = 1e-5
    motion = flown("outgassing_thrust", a1=2.0, arm2=1e-3).at(np.array([0.01 - h, 0.01, 0.01 + h]))
    L = momentum(motion, body.body.inertia_ratios) * body.inertia_kgm2.max()
    R = Rotation.from_quat(motion.q_world_body[1]).as_matrix()
    torque = R @ (body.mass_kg * np.cross([0.0, 1e-3, 0.0], [2.0, 0.0, 0.0]))
    np.testing.assert_allclose((L[2] - L[0]) / (2 * h), torque, rtol=1e-4, atol=1e-4 * np.linalg.norm(torque))
