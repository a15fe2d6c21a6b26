"""Collisions of two bodies: signed gaps, what every collision keeps, what a law of force gives."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.recipes.recipe import ContactRecipe, ParticleRecipe
from synth.contact.collision import kinetic_energy
from synth.contact.law import ContactLaw, contact_law
from synth.contact.pair_collision import PairCollision, Two, collide_pair, first_touch_of_pair
from synth.contact.polytopes import polytope_of, signed_gap
from synth.effects.links import FlyingBody
from synth.motion import Start, fly
from synth.particles.mass_properties import mass_properties
from synth.particles.particle import particle

Array = NDArray[np.float64]
STILL = np.zeros(3)
STEEL = contact_law(ContactRecipe(), ContactRecipe(), {}).stiffness
LAWS = {
    "elastic": ContactLaw(STEEL, 1.0, 0.0),
    "rigid friction": contact_law(ContactRecipe(restitution=0.7, friction=0.3), ContactRecipe(), {}),
    "compliant": contact_law(ContactRecipe(restitution=0.7, friction=0.3), ContactRecipe(), {"tangential_compliance": {"ratio": 1.0}}),
}


def of_mesh(mesh: trimesh.Trimesh) -> FlyingBody:
    known = mass_properties(np.asarray(mesh.vertices), np.asarray(mesh.faces), 2650.0)
    return FlyingBody(np.asarray(mesh.vertices), known.body, known.mass_kg, known.inertia_kgm2)


def cube(side_m: float) -> FlyingBody:
    return of_mesh(trimesh.creation.box((side_m, 1.01 * side_m, 1.02 * side_m)))


def stone(seed: int) -> FlyingBody:
    grain = particle(ParticleRecipe(irregularity=0.5, size_mm=(4.0, 7.0)), 0, np.random.default_rng(seed))
    return FlyingBody(grain.vertices, grain.mass.body, grain.mass.mass_kg, grain.mass.inertia_kgm2)


def meeting(seed: int) -> tuple[Two, tuple[Start, Start]]:
    """Two stones at their first touch."""
    rng = np.random.default_rng(seed)
    bodies = (stone(2 * seed), stone(2 * seed + 1))
    u = rng.normal(size=3) / 1.0
    u /= np.linalg.norm(u)
    starts = [
        Start(side * 6e-3 * u + 3e-4 * rng.normal(size=3), Rotation.random(rng=rng).as_quat(), -side * 0.5 * u, 100 * rng.normal(size=3))
        for side in (-1.0, 1.0)
    ]
    flights = [fly(s, b.inertia_kgm2, STILL, earliest_s=0.0, latest_s=0.02) for s, b in zip(starts, bodies, strict=True)]
    touch = first_touch_of_pair((flights[0], flights[1]), (polytope_of(bodies[0]), polytope_of(bodies[1])), from_s=0.0, to_s=0.02)
    assert touch is not None
    assert touch > 0
    motions = [f.at(np.array([touch])) for f in flights]
    first, second = (Start(m.x_world[0], m.q_world_body[0], m.v_world[0], m.omega_world[0]) for m in motions)
    return bodies, (first, second)


def momenta(bodies: Two, states: tuple[Start, Start]) -> tuple[Array, Array]:
    P, L = np.zeros(3), np.zeros(3)
    for body, state in zip(bodies, states, strict=True):
        R = Rotation.from_quat(state.q_world_body)
        P += body.mass_kg * state.v_world
        L += np.cross(state.x_world, body.mass_kg * state.v_world) + R.apply(body.inertia_kgm2 * R.inv().apply(state.omega_world))
    return P, L


def energy(bodies: Two, states: tuple[Start, Start]) -> float:
    return sum(kinetic_energy(body, state) for body, state in zip(bodies, states, strict=True))


@pytest.fixture(scope="module")
def struck() -> dict[tuple[str, int], tuple[Two, tuple[Start, Start], PairCollision]]:
    found = {}
    for seed in range(5):
        bodies, touch = meeting(seed)
        for name, law in LAWS.items():
            found[name, seed] = (bodies, touch, collide_pair(bodies, touch, law, time_s=0.01, gravity_world=STILL))
    return found


def gap(a: FlyingBody, b: FlyingBody, x: Array, R: Array) -> tuple[float, int]:
    value, kind, _, _ = signed_gap(polytope_of(a), _axes(a), STILL, polytope_of(b), R @ _axes(b), x)
    return float(value), int(kind)


def _axes(body: FlyingBody) -> Array:
    return body.body.R_particle_body


def test_gaps_of_cubes() -> None:
    a, b = cube(2e-3), cube(2e-3)
    corner = Rotation.align_vectors([[-1.0, 0.0, 0.0]], [[1.0, 1.01, 1.02]])[0].as_matrix()
    reach = 1e-3 * np.linalg.norm([1.0, 1.01, 1.02])
    found, kind = gap(a, b, np.array([1e-3 + reach + 5e-5, 1e-4, 2e-4]), corner)
    assert found == pytest.approx(5e-5, abs=1e-12)
    assert kind in {0, 1}
    assert gap(a, b, np.array([1e-3 + reach - 5e-5, 1e-4, 2e-4]), corner)[0] == pytest.approx(-5e-5, abs=1e-12)
    edge_a, edge_b = Rotation.from_euler("z", 45, degrees=True).as_matrix(), Rotation.from_euler("y", 45, degrees=True).as_matrix()
    value, kind, _, _ = signed_gap(polytope_of(a), edge_a @ _axes(a), STILL, polytope_of(b), edge_b @ _axes(b), np.array([3e-3, 0, 0]))
    assert kind == 2
    assert value == pytest.approx(3e-3 - 1e-3 * (1 + 1.01) / 2**0.5 - 1e-3 * (1 + 1.02) / 2**0.5, abs=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_momentum_and_angular_momentum_are_kept_and_energy_is_not_gained(struck, name: str) -> None:
    for (law, _), (bodies, touch, found) in struck.items():
        if law != name:
            continue
        # Over the contact the bodies fly on, which changes neither: angular momentum is about the origin.
        for before, after in zip(momenta(bodies, touch), momenta(bodies, found.after), strict=True):
            assert np.linalg.norm(after - before) <= 1e-11 * np.linalg.norm(before)
        share = energy(bodies, found.after) / energy(bodies, touch)
        assert share <= 1 + 1e-6
        assert share == pytest.approx(1.0, abs=1e-6) if name == "elastic" else share < 0.98


def test_works_account_for_the_energy(struck) -> None:
    for bodies, touch, found in struck.values():
        impact = found.impacts[0]
        lost = energy(bodies, touch) - energy(bodies, found.after)
        assert sum(i.energy_lost_J for i in found.impacts) == pytest.approx(lost, rel=1e-9)
        assert -(impact.normal_work_J + impact.tangential_work_J) == pytest.approx(lost, abs=1e-6 * energy(bodies, touch))


def test_both_sides_of_a_collision(struck) -> None:
    for bodies, touch, found in struck.values():
        first, second = found.impacts
        assert np.allclose(first.impulse_world, -second.impulse_world, rtol=0, atol=0)
        assert np.allclose(first.normal_world, -second.normal_world, rtol=0, atol=0)
        assert first.impulse_world @ first.normal_world > 0
        for body, state, impact in zip(bodies, touch, found.impacts, strict=True):
            change = body.mass_kg * (impact.v_after - impact.v_before)
            assert np.allclose(change, impact.impulse_world, rtol=0, atol=1e-10 * np.linalg.norm(change))
            assert np.array_equal(state.x_world, impact.x_world)
        assert first.duration_s < 1e-4


def test_restitution_and_friction_are_those_of_the_law(struck) -> None:
    singles = 0
    for (name, _), (_, _, found) in struck.items():
        impact = found.impacts[0]
        if len(impact.points_world) > 1:
            continue
        singles += 1
        assert impact.restitution == pytest.approx(LAWS[name].restitution, abs=1e-6)
        normal = float(impact.impulse_world @ impact.normal_world)
        across = np.linalg.norm(impact.impulse_world - normal * impact.normal_world)
        assert across <= (LAWS[name].friction + 1e-3) * normal
    assert singles >= 9


def test_finer_steps_change_nothing(struck) -> None:
    bodies, touch, found = struck["compliant", 0]
    finer = collide_pair(bodies, touch, LAWS["compliant"], time_s=0.01, gravity_world=STILL, finer=2.0)
    for coarse, fine in zip(found.impacts, finer.impacts, strict=True):
        change = np.linalg.norm(coarse.v_after - coarse.v_before)
        assert np.linalg.norm(fine.v_after - coarse.v_after) < 1e-4 * change
        assert np.linalg.norm(fine.omega_after - coarse.omega_after) < 1e-4 * np.linalg.norm(coarse.omega_after - coarse.omega_before)


def test_central_collision_of_unlike_cubes() -> None:
    """A corner on the middle of a face, along the line of centres: Newton's law, ``v' = (m1 v1 + m2 v2 -+ m e u) / (m1 + m2)``."""
    big, small = cube(4e-3), cube(2e-3)
    corner = Rotation.align_vectors([[-1.0, 0.0, 0.0]], [[1.0, 1.01, 1.02]])[0].as_matrix()
    reach = 1e-3 * np.linalg.norm([1.0, 1.01, 1.02])
    turned = Rotation.from_matrix(corner @ _axes(small)).as_quat()
    touch = (
        Start(STILL, Rotation.from_matrix(_axes(big)).as_quat(), STILL, STILL),
        Start(np.array([2e-3 + reach, 0, 0]), turned, np.array([-1.0, 0, 0]), STILL),
    )
    found = collide_pair((big, small), touch, ContactLaw(STEEL, 0.5, 0.2), time_s=0.0, gravity_world=STILL)
    total = big.mass_kg + small.mass_kg
    assert found.after[0].v_world == pytest.approx([-small.mass_kg * 1.5 / total, 0, 0], abs=1e-6)
    assert found.after[1].v_world == pytest.approx([(-small.mass_kg + 0.5 * big.mass_kg) / total, 0, 0], abs=1e-6)
    assert np.linalg.norm(found.after[1].omega_world) < 1e-3


def test_bodies_that_part_do_not_collide() -> None:
    bodies, touch = meeting(0)
    leaving = tuple(Start(s.x_world, s.q_world_body, -s.v_world, STILL) for s in touch)
    with pytest.raises(InputError, match="do not approach one another"):
        collide_pair(bodies, (leaving[0], leaving[1]), LAWS["elastic"], time_s=0.0, gravity_world=STILL)


def test_smooth_bodies_are_refused() -> None:
    with pytest.raises(InputError, match="at most 8000 edges of their convex hulls, got 30720"):
        polytope_of(of_mesh(trimesh.creation.icosphere(subdivisions=5, radius=3e-3)))
