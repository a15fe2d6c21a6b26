"""Collisions of bodies of any shape: against reference cases, balances, Coulomb's cone, rotations of everything, moving plates."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.recipes.recipe import ContactRecipe, PlateRecipe
from datasets.vocabulary.plate import Plate
from synth.contact import ContactLaw, chipped, collide, contact_law
from synth.contact.chipping import chip_of, state_of_part
from synth.contact.collision import kinetic_energy
from synth.contact.touching import lowest, places_of
from synth.effects.links import FlyingBody
from synth.motion import Start, fly
from synth.particles.mass_properties import mass_properties
from tests.synth.contact.bodies import FLAT, NO_GRAVITY, one_corner

LAW = contact_law(ContactRecipe(restitution=0.6, friction=0.2), PlateRecipe(), {})
RIGID = ContactLaw(1e13, 1.0, 0.0)

CASES = {
    "slips throughout": (
        *(6.48e-6, (1.95, 1.72, 1.78, 0.08, 0.15, 0.59), (0.132, 0.535, -0.854), (1.07, -1.4, -0.94), (218, 25, -120), (0.63, 0.3)),
        *((0.91001366252, -1.31684692778, -0.32064697990), (1535.489948389, 96.022915278, 96.988446276)),
    ),
    "sticks in compression": (
        *(8.04e-6, (3.23, 1.95, 2.99, 0.34, 0.16, -0.89), (0.118, -0.671, -0.824), (-0.21, 0.26, -2.89), (-129, 89, 118), (0.56, 0.9)),
        *((-0.40242117809, 1.70011643063, 0.07746168662), (-2093.686828256, -315.287167573, 212.555219085)),
    ),
    "sticks in restitution": (
        *(
            3.752e-5,
            (27.56, 27.55, 29.08, 0.17, -0.54, -0.52),
            (-0.055, -0.052, -1.317),
            (-1.25, -0.19, -1.52),
            (11, -230, 188),
            (0.67, 0.15),
        ),
        *((-0.89547845254, -0.06394478788, 1.06730914762), (56.729540210, -672.207883314, 195.782119553)),
    ),
    "reversal along a ray": (
        *(5.62e-6, (2.32, 0.79, 2.62, 0.76, -0.07, 0.16), (-0.677, 1.384, -0.829), (-0.18, -0.77, -1.71), (160, 178, -191), (0.52, 0.6)),
        *((-0.10253801945, -0.84072688800, -1.34502067723), (1098.990133937, 601.557570142, -319.033573926)),
    ),
    "jam, then stick": (
        *(2.74e-6, (0.77, 0.53, 0.55, -0.17, -0.11, -0.32), (-0.203, -0.573, -1.289), (-1.3, -1.31, -1.19), (-233, -73, -8), (0.8, 1.2)),
        *((-0.78471172956, -0.02328080975, 1.51821254535), (-4.090941141, -671.303381543, -140.660260474)),
    ),
}
"""m kg; I 1e-12 kg m² (xx, yy, zz, xy, xz, yz); r mm; v m/s; omega rad/s; (e, mu); v and omega afterwards: reference/contact.md, A."""


@pytest.mark.parametrize("name", CASES)
def test_a_stiff_contact_gives_what_the_impulse_law_gives(name: str) -> None:
    mass, (xx, yy, zz, xy, xz, yz), r, v, omega, (e, mu), v_after, omega_after = CASES[name]
    arm = np.array(r) * 1e-3
    body, axes = one_corner(arm, mass, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) * 1e-12)
    state = Start(-arm, axes.as_quat(), np.array(v, dtype=float), np.array(omega, dtype=float))
    done = collide(body, state, FLAT, ContactLaw(1e13, e, mu), time_s=0.0, gravity_world=NO_GRAVITY)
    np.testing.assert_allclose(done.after.v_world, v_after, atol=1e-3)
    np.testing.assert_allclose(done.after.omega_world, omega_after, atol=1e-3 * np.linalg.norm(omega_after))
    assert done.impact.restitution == pytest.approx(e, abs=1e-6)
    balance = done.impact.energy_lost_J + done.impact.normal_work_J + done.impact.tangential_work_J
    assert abs(balance) < 1e-9 * kinetic_energy(body, state)


def stone(seed: int) -> tuple[FlyingBody, np.ndarray]:
    points = np.random.default_rng(seed).normal(size=(40, 3))
    hull = trimesh.convex.convex_hull(points / np.linalg.norm(points, axis=1, keepdims=True) * [3e-3, 2.5e-3, 2e-3])
    vertices, faces = np.asarray(hull.vertices), np.asarray(hull.faces)
    mass = mass_properties(vertices, faces, 2650.0)
    return FlyingBody(vertices, mass.body, mass.mass_kg, mass.inertia_kgm2), faces


def touching(body: FlyingBody, plate: Plate, rng: np.random.Generator) -> Start:
    """A random state in which the body's lowest corner lies on the plate and comes down."""
    turned = Rotation.random(rng=rng)
    arms = turned.apply(places_of(body))
    low = arms[np.argmin(arms @ plate.normal_world)]
    omega = rng.normal(size=3) * 100
    v = rng.normal(size=3) * 0.4 - plate.normal_world
    v -= plate.normal_world * max(0.0, 0.3 + float((v + np.cross(omega, low)) @ plate.normal_world))
    return Start(plate.point_world - low, turned.as_quat(), v, omega)


@pytest.mark.parametrize("compliant", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(8))
def test_balances_of_stones(seed: int, compliant: float) -> None:
    """Momentum, angular momentum and energy balance; friction within its cone; no energy made; overlaps as deep as the law allows."""
    body, _ = stone(seed)
    law = replace(LAW, tangential_stiffness=compliant * LAW.stiffness)
    state = touching(body, FLAT, np.random.default_rng(seed))
    done = collide(body, state, FLAT, law, time_s=0.0, gravity_world=NO_GRAVITY)
    impact, energy = done.impact, kinetic_energy(body, state)
    np.testing.assert_allclose(body.mass_kg * (impact.v_after - impact.v_before), impact.impulse_world, rtol=1e-9, atol=1e-15)
    turn_before, turn_after = (angular_momentum(body, s) for s in (state, done.after))
    torque = np.cross(impact.points_world - state.x_world, impact.impulses_world).sum(axis=0)
    np.testing.assert_allclose(turn_after - turn_before, torque, atol=2e-2 * np.linalg.norm(torque))
    assert impact.energy_lost_J == pytest.approx(-impact.normal_work_J - impact.tangential_work_J, abs=1e-8 * energy)
    assert 0 < impact.energy_lost_J < energy
    tangential = np.linalg.norm(impact.impulses_world[:, :2], axis=1)
    assert np.all(tangential <= law.friction * impact.impulses_world[:, 2] * (1 + 1e-6))
    assert 0 < impact.deepest_m <= (energy / (0.4 * law.stiffness)) ** 0.4
    assert lowest_corner(body, done.after) > -1e-12


def angular_momentum(body: FlyingBody, state: Start) -> np.ndarray:
    turned = Rotation.from_quat(state.q_world_body)
    return turned.apply(body.inertia_kgm2 * turned.inv().apply(state.omega_world))


def lowest_corner(body: FlyingBody, state: Start) -> float:
    motion = fly(state, body.inertia_kgm2, NO_GRAVITY, earliest_s=0.0, latest_s=1e-6).at(np.zeros(1))
    return float(lowest(motion, places_of(body), FLAT)[0])


def test_turning_and_moving_everything_turns_and_moves_the_result() -> None:
    body, _ = stone(3)
    state = touching(body, FLAT, np.random.default_rng(5))
    gravity = np.array([1.0, 2.0, -9.0])
    plain = collide(body, state, FLAT, LAW, time_s=0.0, gravity_world=gravity)
    turn, drift = Rotation.random(rng=np.random.default_rng(1)), np.array([0.3, -0.2, 0.5])
    plate = Plate(np.array([0.1, 0.2, 0.7]) - 0.01 * drift, turn.apply(FLAT.normal_world), drift)
    there = Start(
        turn.apply(state.x_world) + np.array([0.1, 0.2, 0.7]),
        (turn * Rotation.from_quat(state.q_world_body)).as_quat(),
        turn.apply(state.v_world) + drift,
        turn.apply(state.omega_world),
    )
    turned = collide(body, there, plate, LAW, time_s=0.01, gravity_world=turn.apply(gravity))
    np.testing.assert_allclose(turned.after.v_world - drift, turn.apply(plain.after.v_world), atol=1e-6)
    np.testing.assert_allclose(turned.after.omega_world, turn.apply(plain.after.omega_world), atol=2e-3)
    np.testing.assert_allclose(turned.impact.impulse_world, turn.apply(plain.impact.impulse_world), atol=1e-9)
    assert turned.impact.normal_work_J == pytest.approx(plain.impact.normal_work_J, rel=1e-5)


def test_a_flat_face_lands_on_all_its_corners() -> None:
    box = trimesh.creation.box((4e-3, 3e-3, 2e-3))
    mass = mass_properties(np.asarray(box.vertices), np.asarray(box.faces), 2650.0)
    body = FlyingBody(np.asarray(box.vertices), mass.body, mass.mass_kg, mass.inertia_kgm2)
    turned = Rotation.from_matrix(mass.body.R_particle_body)
    state = Start(np.array([0, 0, 1e-3]), turned.as_quat(), np.array([0.0, 0, -1]), np.zeros(3))
    done = collide(body, state, FLAT, replace(LAW, restitution=0.7), time_s=0.0, gravity_world=NO_GRAVITY)
    assert len(done.impact.points_world) == 4
    np.testing.assert_allclose(done.after.v_world, [0, 0, 0.7], atol=1e-6)
    np.testing.assert_allclose(done.after.omega_world, 0, atol=1e-6)


def test_a_particle_that_sticks_is_refused() -> None:
    body, _ = stone(1)
    state = touching(body, FLAT, np.random.default_rng(1))
    with pytest.raises(InputError, match="stays on the plate"):
        collide(body, state, FLAT, replace(LAW, pull_off_n=50.0, reach_m=1e-3), time_s=0.0, gravity_world=NO_GRAVITY, finer=0.3)


def test_a_chip_leaves_a_smaller_closed_body_that_moves_on() -> None:
    body, faces = stone(2)
    corner = body.vertices[0]
    rest = chipped(body, faces, corner, 0.2)
    reach = np.linalg.norm(corner - body.body.com_particle)
    along = (rest.vertices - body.body.com_particle) @ (corner - body.body.com_particle) / reach
    assert along.max() == pytest.approx(0.8 * reach)
    mesh = trimesh.Trimesh(rest.vertices, faces, process=False)
    assert mesh.is_watertight
    assert rest.mass_kg == pytest.approx(2650 * mesh.volume)
    assert 0.8 < rest.mass_kg / body.mass_kg < 1
    state = touching(body, FLAT, np.random.default_rng(0))
    after = state_of_part(state, body, rest)
    shared = np.setdiff1d(np.arange(len(body.vertices)), np.flatnonzero(np.any(rest.vertices != body.vertices, axis=1)))[:3]
    for whole, part in zip(*(placed(b, s, shared) for b, s in ((body, state), (rest, after))), strict=True):
        np.testing.assert_allclose(whole, part, atol=1e-12)


def test_a_chip_and_what_is_left_are_the_whole() -> None:
    """Mass, momentum and angular momentum go on, and the chip's surface is closed."""
    body, faces = stone(2)
    rest = chipped(body, faces, body.vertices[0], 0.2)
    chip, chip_faces = chip_of(body, rest, faces)
    assert trimesh.Trimesh(chip.vertices, chip_faces, process=False).is_watertight
    state = touching(body, FLAT, np.random.default_rng(0))
    parts = [(part, state_of_part(state, body, part)) for part in (rest, chip)]
    assert sum(part.mass_kg for part, _ in parts) == pytest.approx(body.mass_kg, rel=1e-9)
    np.testing.assert_allclose(sum(momenta(part, s, state.x_world) for part, s in parts), momenta(body, state, state.x_world), rtol=1e-7)


def momenta(body: FlyingBody, state: Start, about: np.ndarray) -> np.ndarray:
    """Momentum (kg m/s) and angular momentum (kg m²/s) about a point, world frame."""
    R = Rotation.from_quat(state.q_world_body).as_matrix()
    p = body.mass_kg * state.v_world
    spin = R @ (body.inertia_kgm2 * (R.T @ state.omega_world))
    return np.concatenate([p, np.cross(state.x_world - about, p) + spin])


def placed(body: FlyingBody, state: Start, which: np.ndarray) -> np.ndarray:
    """Places and velocities of vertices, world frame."""
    arms = Rotation.from_quat(state.q_world_body).apply(places_of(body)[which])
    return np.hstack([state.x_world + arms, state.v_world + np.cross(state.omega_world, arms)])
