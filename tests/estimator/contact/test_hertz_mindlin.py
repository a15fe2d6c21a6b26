"""Hertz–Mindlin on spheres and clumps: closed forms, reference numbers, energy, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.vocabulary.plate import Plate
from estimator.contact.clump import Clump
from estimator.contact.hertz_mindlin import HertzMindlin, Integration, clamped_restitution, damping_for
from estimator.contact.solid import BodyState, Solid
from estimator.contact.stronge_impulse import StrongeImpulse
from scripts.benchmarks.contact_speeds import FLAT
from tests.estimator.contact.impacts import some_solid, some_state
from tests.reference.contact_reference_cases import (
    CLAMPED_RESTITUTION,
    ELASTIC_SPHERES,
    TEST_4,
    TEST_4_FRICTION,
    ElasticSphere,
    ObliqueSphere,
    ball_clump,
)

ALUMINA = ELASTIC_SPHERES[4]
STEEL = HertzMindlin(1143e9, 0.069, 210e9, 0.30, 0.7, 0.12)


def _falling(v: tuple[float, float, float], omega: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> BodyState:
    return BodyState(np.zeros(3), np.eye(3), np.array(v), np.array(omega))


def _four_balls() -> Clump:
    centres = 1e-3 * np.array([[0.5, 0.1, -0.4], [-0.4, 0.3, 0.2], [0.1, -0.5, 0.3], [-0.2, -0.1, -0.5]])
    return Clump(some_solid(), centres, 1e-3 * np.array([0.3, 0.35, 0.3, 0.25]))


@pytest.mark.parametrize("case", ELASTIC_SPHERES, ids=lambda case: case.name)
def test_elastic_closed_forms_to_1e6(case: ElasticSphere) -> None:
    law = HertzMindlin(case.young_pa, case.poisson, case.plate_young_pa, case.plate_poisson, 1.0, 0.0)
    found = law.through(_falling((0.0, 0.0, -case.approach_m_s)), ball_clump(case), FLAT)
    assert found.deepest_m == pytest.approx(case.depth_m, rel=1e-6)
    assert law.elastic_force_n(found.deepest_m, case.radius_m) == pytest.approx(case.force_n, rel=1e-6)
    assert found.duration_s == pytest.approx(case.contact_s, rel=1e-6)
    assert found.after.v_world[2] == pytest.approx(case.approach_m_s, rel=1e-7)


@pytest.mark.parametrize("case", TEST_4, ids=lambda case: f"{case.angle_deg:g} degrees")
def test_oblique_alumina_of_test_4(case: ObliqueSphere) -> None:
    law = HertzMindlin(ALUMINA.young_pa, ALUMINA.poisson, math.inf, 0.3, 1.0, TEST_4_FRICTION)
    angle = math.radians(case.angle_deg)
    along, down = 3.9 * math.sin(angle), 3.9 * math.cos(angle)
    found = law.through(_falling((along, 0.0, -down)), ball_clump(ALUMINA), FLAT)
    assert found.after.v_world[0] / along == pytest.approx(case.tangential_ratio, rel=5e-4)
    assert found.after.omega_world[1] == pytest.approx(case.spin_rad_s, rel=5e-4)


def test_full_sliding_is_the_closed_form() -> None:
    law = HertzMindlin(70e9, 0.3, 210e9, 0.3, 0.6, 0.1)
    ball = ball_clump(ALUMINA)
    found = law.through(_falling((3.0, 0.0, -1.0)), ball, FLAT)
    assert found.after.v_world[0] == pytest.approx(3.0 - 0.1 * 1.6 * 1.0, rel=1e-6)
    assert found.after.omega_world[1] == pytest.approx(5.0 * 0.1 * 1.6 * 1.0 / (2.0 * ALUMINA.radius_m), rel=1e-6)


@pytest.mark.parametrize("e", [0.02, 0.1, 0.3, 0.5, 0.7, 0.9])
def test_the_restitution_asked_for_is_the_one_delivered(e: float) -> None:
    found = replace(STEEL, restitution=e).through(_falling((0.0, 0.0, -1.3)), ball_clump(ALUMINA), FLAT)
    assert found.after.v_world[2] / 1.3 == pytest.approx(e, rel=1e-6)


@pytest.mark.parametrize("e", [0.3, 0.8])
def test_an_eccentric_contact_delivers_it_too(e: float) -> None:
    clump = Clump(some_solid(), np.array([[3e-4, -2e-4, -5e-4]]), np.array([2e-4]))
    found = replace(STEEL, restitution=e, friction=0.0).through(_falling((0.0, 0.0, -1.0)), clump, FLAT)
    lever = np.array([3e-4, -2e-4, -7e-4])
    leaving = (found.after.v_world + np.cross(found.after.omega_world, lever))[2]
    assert leaving == pytest.approx(e, rel=3e-3)


@pytest.mark.parametrize(("unclamped", "delivered"), CLAMPED_RESTITUTION)
def test_what_clamping_does_to_restitution(unclamped: float, delivered: float) -> None:
    beta = -math.log(unclamped) / math.hypot(math.log(unclamped), math.pi)
    assert clamped_restitution(beta) == pytest.approx(delivered, abs=0.51e-5)
    assert clamped_restitution(damping_for(unclamped)) == pytest.approx(unclamped, rel=1e-12)


def test_scaling_every_modulus_leaves_the_rebound() -> None:
    soft = replace(STEEL, young_particle_pa=11.43e9, young_plate_pa=2.1e9)
    state, ball = _falling((0.4, 0.0, -1.0), (50.0, -20.0, 30.0)), ball_clump(ALUMINA)
    hard_found, soft_found = STEEL.through(state, ball, FLAT), soft.through(state, ball, FLAT)
    np.testing.assert_allclose(soft_found.after.v_world, hard_found.after.v_world, rtol=2e-3, atol=1e-3)
    assert soft_found.duration_s == pytest.approx(hard_found.duration_s * 100 ** (2 / 5), rel=1e-3)


def test_a_stiff_sphere_that_slips_agrees_with_the_impulse_model() -> None:
    state, ball = _falling((4.0, 1.0, -1.0)), ball_clump(ALUMINA)
    rigid = StrongeImpulse(STEEL.restitution, STEEL.friction).strike(state, ball.solid, np.array([0, 0, -ALUMINA.radius_m]), FLAT)
    found = STEEL.through(state, ball, FLAT)
    np.testing.assert_allclose(found.after.v_world, rigid.after.v_world, atol=1e-4)
    np.testing.assert_allclose(found.after.omega_world, rigid.after.omega_world, atol=0.05)


@pytest.mark.parametrize("e", [0.3, 0.8])
def test_four_spheres_that_land_level_deliver_it_too(e: float) -> None:
    solid = Solid(5e-6, 2e-9, np.diag([1.0e-12, 1.2e-12, 1.5e-12]))
    corners = 1e-3 * np.array([[0.5, 0, -0.4], [-0.5, 0, -0.4], [0, 0.5, -0.4], [0, -0.5, -0.4]])
    found = replace(STEEL, restitution=e).through(_falling((0.0, 0.0, -1.0)), Clump(solid, corners, np.full(4, 3e-4)), FLAT)
    assert found.most_touching == 4
    assert found.energy_off < 1e-6
    assert found.after.v_world[2] == pytest.approx(e, rel=1e-6)
    np.testing.assert_allclose(found.after.omega_world, 0.0, atol=1e-6)


def test_no_energy_is_made_with_damping_and_friction() -> None:
    rng, clump = np.random.default_rng(3), _four_balls()
    done = 0
    for _ in range(60):
        state = some_state(rng)
        try:
            found = STEEL.through(state, clump, FLAT)
        except InputError:
            continue
        done += 1
        assert found.after.energy_j(clump.solid) < state.energy_j(clump.solid)
        assert found.energy_off < 1e-6
    assert done > 40


def test_turning_everything_turns_the_outcome() -> None:
    rng, clump = np.random.default_rng(8), _four_balls()
    state, moving = some_state(rng), np.array([0.1, -0.2, 0.4])
    here = STEEL.through(state, clump, FLAT)
    Q = Rotation.random(rng=rng).as_matrix()
    turned = BodyState(Q @ state.x_world, Q @ state.R_world_body, Q @ (state.v_world + moving), Q @ state.omega_world)
    there = STEEL.through(turned, clump, Plate(np.zeros(3), Q @ FLAT.normal_world, Q @ moving))
    np.testing.assert_allclose(there.after.v_world, Q @ (here.after.v_world + moving), atol=1e-4)
    np.testing.assert_allclose(there.after.omega_world, Q @ here.after.omega_world, atol=0.3)
    np.testing.assert_allclose(there.after.x_world, Q @ (here.after.x_world + moving * here.duration_s), atol=1e-9)
    np.testing.assert_allclose(there.after.R_world_body, Q @ here.after.R_world_body, atol=1e-6)


def test_a_second_touch_within_the_quiet_time_belongs_to_the_impact() -> None:
    """A dumb-bell that comes down on one end slaps down with the other."""
    solid = Solid(5e-6, 2e-9, np.diag([1e-12, 1e-12, 2e-13]))
    bell = Clump(solid, 1e-3 * np.array([[0.9, 0.0, 0.0], [-0.9, 0.0, 0.0]]), np.array([3e-4, 3e-4]))
    tilted = Rotation.from_euler("y", 8, degrees=True).as_matrix()
    state = BodyState(np.zeros(3), tilted, np.array([0.0, 0.0, -1.0]), np.zeros(3))
    once, twice = STEEL.through(state, bell, FLAT), STEEL.through(state, bell, FLAT, Integration(quiet_s=1e-3))
    assert once.duration_s < 2e-5
    assert twice.duration_s > 5e-5
    assert twice.after.v_world[2] > once.after.v_world[2]


def test_a_time_step_that_is_too_large_is_seen_by_energy() -> None:
    ball, state = ball_clump(ALUMINA), _falling((0.0, 0.0, -3.9))
    elastic = HertzMindlin(ALUMINA.young_pa, ALUMINA.poisson, math.inf, 0.3, 1.0, 0.1)
    fine = elastic.through(state, ball, FLAT, Integration(step_s=5e-8))
    assert fine.after.v_world[2] == pytest.approx(3.9, rel=1e-5)
    with pytest.raises(
        InputError, match=r"time step 2e-06 s is too large for this contact: expected the energy balance to hold to 0\.0001"
    ):
        elastic.through(state, ball, FLAT, Integration(step_s=2e-6))
    with pytest.raises(InputError, match=r"time step 0\.001 s is too large"):
        elastic.through(state, ball, FLAT, Integration(step_s=1e-3))
    with pytest.raises(InputError, match="time step: expected a number from 0 s upwards, got -1"):
        Integration(step_s=-1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"restitution": 1.1}, r"restitution: expected a number above 0 to 1, got 1\.1"),
        ({"restitution": 0.0}, r"restitution: expected a number above 0 to 1, got 0"),
        ({"friction": -0.1}, r"friction coefficient: .* got -0\.1"),
        ({"poisson_particle": 0.5}, r"Poisson's ratio of the particle: expected above -1 and below 0\.5, got 0\.5"),
        ({"poisson_plate": -1.0}, r"Poisson's ratio of the plate: .* got -1"),
        ({"young_particle_pa": 0.0}, r"Young's modulus of the particle: expected a finite number above 0 Pa, got 0"),
        ({"young_particle_pa": math.inf}, r"Young's modulus of the particle: expected a finite number"),
        ({"young_plate_pa": -5.0}, r"Young's modulus of the plate: expected a number above 0 Pa, got -5"),
    ],
)
def test_impossible_constants_are_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(STEEL, **change)


def test_a_clump_that_leaves_is_refused() -> None:
    with pytest.raises(InputError, match="approaches the plate"):
        STEEL.through(_falling((0.0, 0.0, 0.5)), ball_clump(ALUMINA), FLAT)
