"""The reduced laws of the ladder: their limits, closed forms, balances and what they refuse."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from datasets.errors import InputError, TumbleError
from estimator.contact.stronge_impulse import StrongeImpulse
from estimator.contact_validation.contacts import Contacts, nominal, tilted
from estimator.contact_validation.laws import point_contact as point_contacts
from estimator.contact_validation.laws.lumped_kernel import spring, spring_many
from estimator.contact_validation.laws.models import ADDITIONS, impulse_model
from estimator.contact_validation.laws.point_contact import STIFFEST, PointContact, compression_work, point_contact
from tests.estimator.contact_validation.made_impacts import made_impacts

RIGID = PointContact(0.6, 0.15)
CREEP = 3e4
"""Rate at which a tangential force over the limit falls back to it, per unit of dimensionless time."""


def contacts() -> Contacts:
    return nominal(made_impacts(RIGID, 30, 1))


def energy(rows: np.ndarray, c: Contacts) -> np.ndarray:
    """Kinetic energy over mass, m²/s²."""
    inertia = np.linalg.inv(c.turning)
    return 0.5 * (rows[:, :3] ** 2).sum(axis=1) + 0.5 * np.einsum("ni,nij,nj->n", rows[:, 3:], inertia, rows[:, 3:])


def test_the_base_is_the_stronge_impulse() -> None:
    impacts = made_impacts(RIGID, 8, 2)
    after = RIGID.after(impacts)
    for row, impact in zip(after, impacts, strict=True):
        contact = impact.state.x_world + nominal([impact]).lever[0]
        struck = StrongeImpulse(0.6, 0.15).strike(impact.state, impact.particle.solid, contact, impact.plate).after
        np.testing.assert_allclose(row[:3], struck.v_world, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(row[3:], struck.omega_world, rtol=1e-9, atol=1e-9)


def test_without_friction_it_is_the_frictionless_impulse() -> None:
    """P = (1 + e) |uₙ| / Kₙₙ along the normal."""
    c = contacts()
    plain = np.zeros_like(c.velocities)
    plain[:, 2] = -(1.0 + 0.6) * c.velocities[:, 2] / c.matrices[:, 2, 2]
    np.testing.assert_allclose(PointContact(0.6).impulses(c), plain, atol=1e-9)


@pytest.mark.parametrize("physics", ADDITIONS, ids=lambda p: p.key)
def test_every_addition_is_nothing_at_zero(physics) -> None:
    model = impulse_model([physics.key])
    impacts = made_impacts(RIGID, 5, 3)
    values = np.array([0.6, 0.15, *([0.0] * len(physics.parameters))])
    np.testing.assert_array_equal(model.predict(impacts, values), RIGID.after(impacts))


@pytest.mark.parametrize("physics", ADDITIONS, ids=lambda p: p.key)
def test_every_addition_does_something(physics) -> None:
    model = impulse_model([physics.key])
    impacts = made_impacts(RIGID, 5, 3)
    values = np.array([0.6, 0.15, *(0.1 * p.bounds[1] for p in physics.parameters)])
    assert np.abs(model.predict(impacts, values) - RIGID.after(impacts))[:, :3].max() > 1e-2


def test_a_stiff_tangential_spring_is_rigid_friction() -> None:
    c = contacts()
    stiff = PointContact(0.6, 0.15, compliance=0.021).after_contacts(c)
    off = np.abs(stiff - RIGID.after_contacts(c))
    assert np.median(off[:, :3]) < 2e-3
    assert off[:, :3].max() < 3e-2


def _hertz_mindlin_swing(e: float, ratio: float, K: np.ndarray, u: np.ndarray, friction: float) -> np.ndarray:
    """Compression and opening integrated one after the other by SciPy, the overlap at each from its own side; friction as a steep creep."""

    def rates(overlap_of: Any, share: float) -> Any:
        def of(_t: float, y: np.ndarray) -> np.ndarray:
            overlap = max(overlap_of(y[3]), 1e-14)
            S = 1.5 * ratio * np.sqrt(overlap)
            fall = y[4:] * max(y[2], 0.0) / (2.0 * share * overlap) if share < np.inf else 0.0
            held = float(np.linalg.norm(y[4:]))
            creep = CREEP * max(held - friction * overlap**1.5, 0.0) * y[4:] / max(held, 1e-14)
            return np.concatenate([K @ [*y[4:], overlap**1.5], [-y[2]], -S * y[:2] - fall - creep])

        return of

    def still(_t: float, y: np.ndarray) -> float:
        return float(y[2])

    still.terminal = True  # type: ignore[attr-defined]
    how: dict[str, Any] = {"method": "LSODA", "rtol": 1e-9, "atol": 1e-11}
    down = solve_ivp(rates(lambda depth: depth, np.inf), (0.0, 10.0), [*u, 0.0, 0.0, 0.0], events=still, **how).y[:, -1]
    deepest, share = down[3], e**2

    def parted(_t: float, y: np.ndarray) -> float:
        return float(y[3] - (1.0 - share) * deepest - 1e-9)

    parted.terminal = True  # type: ignore[attr-defined]
    up = solve_ivp(rates(lambda depth: (depth - (1.0 - share) * deepest) / share, share), (0.0, 10.0), down, events=parted, **how)
    return np.asarray(up.y[:3, -1])


@pytest.mark.parametrize("friction", [0.05, 0.2, 1e6])
@pytest.mark.parametrize("ratio", [0.2, 0.85, 2.0])
@pytest.mark.parametrize("e", [0.5, 1.0])
def test_springs_agree_with_another_integration(ratio: float, e: float, friction: float) -> None:
    K, u = np.array([[3.5, 0.2, 0.3], [0.2, 2.5, -0.1], [0.3, -0.1, 1.0]]), np.array([0.2, -0.1, -1.0])
    after = spring_many(K[None], u[None], np.array([e]), friction, ratio)[0]
    np.testing.assert_allclose(after, _hertz_mindlin_swing(e, ratio, K, u, friction), atol=4e-4)


def test_what_comes_out_scales_with_the_speed() -> None:
    """Followed as it is: :func:`spring_many` would divide by the speed first."""
    K, u = np.array([[3.5, 0.2, 0.3], [0.2, 2.5, -0.1], [0.3, -0.1, 1.0]]), np.array([0.4, -0.1, -1.0])
    slow, fast = np.empty(3), np.empty(3)
    spring(K, 0.1 * u, 0.6, 0.2, 0.9, slow)
    spring(K, 8.0 * u, 0.6, 0.2, 0.9, fast)
    np.testing.assert_allclose(slow / 0.1, fast / 8.0, atol=4e-4)


def test_contacts_that_graze_are_followed_to_their_end() -> None:
    rng = np.random.default_rng(3)
    c = contacts()
    u = c.velocities * [1.0, 1.0, 1e-3]
    for e in (0.02, 0.5, 1.0):
        after = spring_many(c.matrices, u, np.full(len(u), e), float(rng.uniform(0.0, 2.0)), 1.0 / STIFFEST)
        assert (after[:, 2] > -1e-9).all()


def test_a_contact_that_never_parts_is_an_error_not_a_velocity(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(point_contacts, "spring_many", lambda K, u, *_: np.where(np.arange(len(u))[:, None] == 1, np.nan, u))
    with pytest.raises(TumbleError, match=r"contact 1 on springs of .* expected that it parts"):
        PointContact(0.6, 0.3, compliance=1.0).impulses(contacts())


@pytest.mark.parametrize("e", [0.1, 0.6, 0.95])
def test_the_normal_spring_gives_back_the_share_asked_for(e: float) -> None:
    after = spring_many(np.eye(3)[None], np.array([[0.3, 0.0, -1.0]]), np.array([e]), 0.0, 1.0)[0]
    np.testing.assert_allclose(after, [0.3, 0.0, e], atol=1e-4)


def test_no_law_makes_energy() -> None:
    c = contacts()
    before = energy(np.concatenate([c.v, c.omega], axis=1), c)
    laws = [RIGID, PointContact(1.0, 0.4), PointContact(0.9, 0.3, compliance=1.0), PointContact(0.7, 0.2, slowing=0.25, adhesion=0.02)]
    for law in laws:
        assert (energy(law.after_contacts(c), c) <= before * (1.0 + 1e-4)).all()


def test_adhesion_costs_the_energy_it_says() -> None:
    c = contacts()
    lost = energy(RIGID.after_contacts(c), c) - energy(PointContact(0.6, 0.15, adhesion=0.01).after_contacts(c), c)
    np.testing.assert_allclose(lost, _lost_closed_form(c, 0.01), rtol=1e-6)


def _lost_closed_form(c: Contacts, adhesion: float) -> np.ndarray:
    """The work of a normal impulse, all of ``adhesion`` where the corner parts at all."""
    K, u = c.matrices, c.velocities + np.einsum("nij,nj->ni", c.matrices, RIGID.impulses(c))
    return np.minimum(adhesion, 0.5 * u[:, 2] ** 2 / K[:, 2, 2])


def test_restitution_falls_with_the_power_asked_for() -> None:
    law = PointContact(0.5, 0.1, slowing=0.25)
    work = np.array([0.5, 0.5 * 256.0])
    np.testing.assert_allclose(law.restitutions(work), [0.5, 0.25])


def test_compression_of_a_central_contact_takes_all_its_energy() -> None:
    assert compression_work(np.eye(3)[None], np.array([[0.0, 0.0, -2.0]]), 0.3)[0] == pytest.approx(2.0, rel=1e-9)


def test_a_free_plate_of_the_same_mass_halves_a_central_impulse() -> None:
    c = contacts()
    one = Contacts(c.axes[:1], np.zeros((1, 3)) + 1e-9 * c.axes[:1, 2], c.turning[:1], -c.axes[:1, 2], np.zeros((1, 3)), np.zeros((1, 3)))
    np.testing.assert_allclose(PointContact(0.6, 0.0, recoil=1.0).impulses(one)[0, 2], 0.8, rtol=1e-9)


def test_a_tilt_turns_the_normal_by_its_angle() -> None:
    normal = np.array([0.3, -math.sqrt(1 - 0.09), 0.0])
    assert math.acos(float(tilted(normal, (0.05, 0.0)) @ normal)) == pytest.approx(0.05, rel=1e-6)
    assert math.acos(float(tilted(normal, (0.0, -0.02)) @ normal)) == pytest.approx(0.02, rel=1e-6)
    assert tilted(normal, (0.05, 0.0))[2] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"restitution": 1.01}, "coefficient of restitution"),
        ({"restitution": 0.5, "friction": -0.1}, "friction coefficient"),
        ({"restitution": 0.5, "compliance": -1.0}, "compliance"),
        ({"restitution": 0.5, "magnetism": 1.0}, "magnetism"),
    ],
)
def test_impossible_constants_are_refused(values, words) -> None:
    with pytest.raises(InputError, match=words):
        point_contact(values)
