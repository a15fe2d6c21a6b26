"""The Mirtich–Stronge model against reference impacts, identities and random impacts."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.vocabulary.plate import Plate
from estimator.contact.rigid_impulses import Impulses
from estimator.contact.solid import BodyState, Solid
from estimator.contact.sphere_equivalent import sphere_of
from estimator.contact.stronge_impulse import StrongeImpulse
from estimator.contact.velocity_impulse import NewtonImpulse, PoissonImpulse
from scripts.benchmarks.contact_speeds import FLAT, random_contacts
from tests.estimator.contact.impacts import some_solid, some_state
from tests.reference.contact_reference_cases import ENERGY_RATIOS, FULL_CASES, EnergyRatio, ReferenceImpact


def _random(count: int, e: float, mu: float) -> tuple[np.ndarray, np.ndarray, Impulses]:
    K, u = random_contacts(np.random.default_rng(round(1e3 * (10 * e + mu))), count)
    return K, u, StrongeImpulse(e, mu).follow(K, u)


@pytest.mark.parametrize("case", FULL_CASES, ids=lambda case: case.name)
def test_full_cases_come_out_to_1e8(case: ReferenceImpact) -> None:
    found = StrongeImpulse(case.restitution, case.friction).strike(case.state, case.solid, case.lever, FLAT)
    np.testing.assert_allclose(found.after.v_world, case.v_after, rtol=1e-8)
    np.testing.assert_allclose(found.after.omega_world, case.omega_after, rtol=1e-8)


def test_each_way_a_contact_can_end_is_told() -> None:
    words = [StrongeImpulse(c.restitution, c.friction).strike(c.state, c.solid, c.lever, FLAT).sliding for c in FULL_CASES]
    assert words == ["slips throughout", "sticks", "sticks", "slips anew along the diverging ray", "sticks"]


def test_a_jam_leaves_faster_than_it_came() -> None:
    case = FULL_CASES[-1]
    found = StrongeImpulse(case.restitution, case.friction).strike(case.state, case.solid, case.lever, FLAT)
    assert found.u_before[2] == pytest.approx(-1.07131, abs=5e-6)
    assert found.u_after[2] == pytest.approx(1.384282, abs=5e-7)


@pytest.mark.parametrize("case", ENERGY_RATIOS, ids=lambda case: case.name)
def test_energy_under_the_three_restitutions(case: EnergyRatio) -> None:
    for law, ratio, digits in zip((NewtonImpulse, PoissonImpulse, StrongeImpulse), case.ratios, case.digits, strict=True):
        found = law(case.restitution, case.friction).strike(case.state, case.solid, np.array(case.lever), FLAT)
        assert found.after.energy_j(case.solid) / case.state.energy_j(case.solid) == pytest.approx(ratio, abs=0.51 * 10.0**-digits)
    if case.u_after:
        np.testing.assert_allclose(found.u_after[[0, 2]], case.u_after, atol=0.51e-9)


@pytest.mark.parametrize(("e", "mu"), [(0.0, 0.3), (0.5, 0.05), (0.7, 0.3), (0.9, 1.0), (1.0, 0.6)])
def test_ten_thousand_random_impacts_keep_the_laws_of_physics(e: float, mu: float) -> None:
    K, u, found = _random(2000, e, mu)
    before = -0.5 * np.einsum("ni,nij,nj->n", u, np.linalg.inv(K), u)
    gained = 0.5 * np.einsum("ni,ni->n", u + found.velocity_after, found.impulse)
    scale = np.abs(before)
    assert (gained <= 1e-9 * scale).all()
    assert (gained >= before * (1 + 1e-9)).all()
    normal = found.impulse[:, 2]
    assert (normal > 0).all()
    assert (np.linalg.norm(found.impulse[:, :2], axis=1) <= mu * normal * (1 + 1e-9)).all()
    assert (found.compression_j < 0).all()
    np.testing.assert_allclose(found.normal_j, (1 - e**2) * found.compression_j, atol=1e-10 * scale.max(), rtol=1e-9)


def test_random_impacts_end_in_every_way() -> None:
    _, _, found = _random(2000, 0.7, 0.3)
    assert set(found.sliding) == {"slips throughout", "sticks", "slips anew along the diverging ray"}


def _small_steps(K: np.ndarray, u: np.ndarray, e: float, mu: float) -> tuple[np.ndarray, np.ndarray]:
    """u after (n, 3) and W (n,) by plain steps of pₙ, all contacts at once: another road to the same end, good to about a step."""
    u, work, deepest, open_ = u.copy(), np.zeros(len(u)), np.zeros(len(u)), np.ones(len(u), dtype=bool)
    step = 4.0 * np.abs(u[:, 2]) / K[:, 2, 2] / 8000
    rest = -np.linalg.solve(K[:, :2, :2], K[:, :2, 2:])[:, :, 0]
    holds = np.linalg.norm(rest, axis=1) <= mu
    for _ in range(200_000):
        speed = np.linalg.norm(u[:, :2], axis=1)
        stuck = holds & (speed <= 3.0 * np.linalg.norm(K[:, :2], axis=(1, 2)) * (1.0 + mu) * step)
        along = np.where(stuck[:, None], rest, -mu * u[:, :2] / np.maximum(speed, 1e-300)[:, None])
        u_new = u + np.einsum("nij,nj->ni", K, np.column_stack([along, np.ones(len(u))])) * step[:, None]
        u_new[stuck, :2] = 0.0
        more = 0.5 * (u[:, 2] + u_new[:, 2]) * step
        u, work = np.where(open_[:, None], u_new, u), np.where(open_, work + more, work)
        deepest = np.minimum(deepest, work)
        open_ &= ~((u[:, 2] > 0.0) & (work >= (1 - e**2) * deepest))
        if not open_.any():
            return u, work
    raise AssertionError("no end")


def test_plain_small_steps_come_to_the_same_end() -> None:
    K, u = random_contacts(np.random.default_rng(21), 150)
    found = StrongeImpulse(0.7, 0.8).follow(K, u)
    assert len(set(found.sliding)) >= 2
    after, work = _small_steps(K, u, 0.7, 0.8)
    speed = np.linalg.norm(u, axis=1)
    assert (np.linalg.norm(after - found.velocity_after, axis=1) < 6e-3 * speed).all()
    np.testing.assert_allclose(work, found.normal_j, atol=1e-2 * np.abs(found.normal_j).max())


def test_no_friction_and_no_loss_keep_the_energy() -> None:
    _, u, found = _random(500, 1.0, 0.0)
    lost = 0.5 * np.einsum("ni,ni->n", u + found.velocity_after, found.impulse)
    assert np.abs(lost).max() < 1e-10 * np.abs(found.compression_j).max()


def test_the_normal_work_is_what_the_normal_impulse_did_when_sliding_does_not_turn() -> None:
    """A planar impact that slips throughout one way has straight uₙ(pₙ), so W is the trapezium's area."""
    case = ENERGY_RATIOS[2]
    state = BodyState(np.zeros(3), np.eye(3), np.array([-5.0, 0.0, -1.0]), np.zeros(3))
    found = StrongeImpulse(0.5, 0.1).strike(state, case.solid, np.array(case.lever), FLAT)
    assert found.sliding == "slips throughout"
    assert found.normal_j == pytest.approx(0.5 * (found.u_before[2] + found.u_after[2]) * found.impulse_world[2], rel=1e-9)


@pytest.mark.parametrize("tangential", [0.5, 1.9, 2.2, 8.0])
def test_sphere_on_plane_closed_form(tangential: float) -> None:
    e, mu, m = 0.6, 0.2, 4e-6
    ball = sphere_of(Solid(m, 1.2e-9, np.eye(3)))
    lever = np.array([0.0, 0.0, -ball.equivalent_radius_m])
    state = BodyState(np.zeros(3), np.eye(3), np.array([0.6 * tangential, -0.8 * tangential, -2.0]), np.zeros(3))
    found = StrongeImpulse(e, mu).strike(state, ball, lever, FLAT)
    slips = tangential >= 3.5 * mu * (1 + e) * 2.0
    size = mu * m * (1 + e) * 2.0 if slips else 2.0 / 7.0 * m * tangential
    np.testing.assert_allclose(found.impulse_world, [-0.6 * size, 0.8 * size, m * (1 + e) * 2.0], rtol=1e-9)
    assert found.sliding == ("slips throughout" if slips else "sticks")


def test_turning_everything_turns_the_outcome() -> None:
    rng = np.random.default_rng(5)
    solid, law = some_solid(), StrongeImpulse(0.7, 0.25)
    for _ in range(20):
        state = some_state(rng)
        lever = rng.normal(size=3) * 5e-4 - np.array([0.0, 0.0, 1e-3])
        Q = Rotation.random(rng=rng).as_matrix()
        moving = np.array([0.3, 0.1, -0.2])
        turned = BodyState(Q @ state.x_world, Q @ state.R_world_body, Q @ (state.v_world + moving), Q @ state.omega_world)
        if (state.v_world + np.cross(state.omega_world, lever))[2] >= 0:
            continue
        here = law.strike(state, solid, state.x_world + lever, FLAT)
        there = law.strike(turned, solid, Q @ (state.x_world + lever), Plate(np.zeros(3), Q @ FLAT.normal_world, Q @ moving))
        np.testing.assert_allclose(there.after.v_world, Q @ (here.after.v_world + moving), atol=1e-9)
        np.testing.assert_allclose(there.after.omega_world, Q @ here.after.omega_world, atol=1e-6)


def test_momentum_and_spin_change_by_one_impulse() -> None:
    state, solid = some_state(np.random.default_rng(1)), some_solid()
    lever = np.array([2e-4, 3e-4, -9e-4])
    found = StrongeImpulse(0.5, 0.3).strike(state, solid, state.x_world + lever, FLAT)
    np.testing.assert_allclose(solid.mass_kg * (found.after.v_world - state.v_world), found.impulse_world, rtol=1e-9)
    spun = solid.inertia_world(state.R_world_body) @ (found.after.omega_world - state.omega_world)
    np.testing.assert_allclose(spun, np.cross(lever, found.impulse_world), rtol=1e-9, atol=1e-18)
    np.testing.assert_allclose(found.u_after, found.after.v_world + np.cross(found.after.omega_world, lever), atol=1e-9)


@pytest.mark.parametrize("law", [StrongeImpulse, NewtonImpulse, PoissonImpulse])
def test_impossible_constants_are_refused(law: type) -> None:
    with pytest.raises(InputError, match=r"restitution: expected a number from 0 to 1, got 1\.2"):
        law(1.2, 0.3)
    with pytest.raises(InputError, match=r"restitution: .* got -0\.1"):
        law(-0.1, 0.3)
    with pytest.raises(InputError, match=r"restitution: .* got nan"):
        law(float("nan"), 0.3)
    with pytest.raises(InputError, match=r"friction coefficient: expected a number from 0 upwards, got -0\.3"):
        law(0.5, -0.3)


def test_a_contact_point_that_leaves_is_refused() -> None:
    state = BodyState(np.zeros(3), np.eye(3), np.array([0.0, 0.0, 0.5]), np.zeros(3))
    with pytest.raises(InputError, match=r"expected a contact point that approaches the plate, got normal velocity \+0\.5 m/s"):
        StrongeImpulse(0.5, 0.3).strike(state, some_solid(), np.array([0.0, 0.0, -1e-3]), FLAT)
