"""The law of one corner: Hertz's closed forms, restitution delivered as asked, and what may be hidden in it."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.recipes.recipe import ContactRecipe, PlateRecipe
from synth.contact import ContactLaw, collide, contact_law
from tests.synth.contact.bodies import FLAT, NO_GRAVITY, ball, dropped

RADIUS, MASS = 1e-3, 1.4724e-5
LAW = contact_law(ContactRecipe(restitution=1, friction=0, corner_radius_mm=1e3 * RADIUS), PlateRecipe(), {})
BALL = ball(RADIUS, MASS)


def bounced(law: ContactLaw, speed: float = 1.0, finer: float = 1.0):
    return collide(BALL, dropped((0, 0, -speed), height_m=RADIUS), FLAT, law, time_s=0.0, gravity_world=NO_GRAVITY, finer=finer)


def test_hertz_closed_forms() -> None:
    """Diamond on steel, R 1 mm, 2 m/s: overlap, force over mass and duration of reference/contact.md."""
    contact = ContactRecipe(restitution=1, friction=0, youngs_gpa=1143, poisson=0.069, corner_radius_mm=1)
    law = contact_law(contact, PlateRecipe(youngs_gpa=210, poisson=0.30), {})
    body = ball(1e-3, 3515 * 4 / 3 * np.pi * 1e-9)
    done = collide(body, dropped((0, 0, -2), height_m=1e-3), FLAT, law, time_s=0.0, gravity_world=NO_GRAVITY)
    assert done.impact.deepest_m == pytest.approx(2.4174358e-6, rel=1e-6)
    assert law.stiffness * done.impact.deepest_m**1.5 == pytest.approx(30.452923, rel=1e-6)
    assert done.impact.duration_s == pytest.approx(3.5575894e-6, rel=1e-3)


def test_an_elastic_ball_without_friction_rebounds_as_it_came() -> None:
    done = bounced(LAW, 1.3)
    assert done.after.v_world[2] == pytest.approx(1.3, abs=1e-6 * 1.3)
    assert done.impact.restitution == pytest.approx(1, abs=1e-6)
    assert abs(done.impact.energy_lost_J) < 1e-6 * 0.5 * MASS * 1.3**2


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("speed", [0.05, 4.0])
def test_restitution_is_delivered_at_any_speed(e: float, speed: float) -> None:
    done = bounced(replace(LAW, restitution=e), speed)
    assert done.after.v_world[2] / speed == pytest.approx(e, rel=1e-6)
    assert done.impact.restitution == pytest.approx(e, rel=1e-6)


def test_restitution_falls_with_the_fourth_root_of_the_speed_above_yield() -> None:
    law = replace(LAW, restitution=0.8, yield_speed=0.5)
    slow, at_yield, fast = (bounced(law, speed).impact.restitution for speed in (0.2, 0.5, 2.0))
    assert slow == pytest.approx(0.8, rel=1e-6)
    assert at_yield == pytest.approx(0.8, rel=1e-4)
    assert fast == pytest.approx(0.8 * 4**-0.25, rel=1e-5)


@pytest.mark.parametrize("e", [1.0, 0.6])
def test_adhesion_costs_its_work_at_any_speed(e: float) -> None:
    law = replace(LAW, restitution=e, pull_off_n=0.05, reach_m=2e-5)
    for speed in (0.8, 2.0):
        loss = 0.5 * MASS * speed**2 * e**2 - 0.5 * MASS * bounced(law, speed).after.v_world[2] ** 2
        assert loss == pytest.approx(2 / 3 * 0.05 * 2e-5, rel=1e-3)


def test_a_plate_that_gives_way_takes_its_share() -> None:
    """Two free masses: relative speed e of what it was, momentum kept."""
    law = replace(LAW, restitution=0.7, inverse_plate_mass=1 / (4 * MASS))
    assert bounced(law, 1.0).after.v_world[2] == pytest.approx((0.7 * 4 - 1) / 5, rel=1e-6)


def test_tangential_compliance_turns_a_gentle_slip_round() -> None:
    """Where rigid friction brings the contact point to rest, a spring gives some of it back [Maw, Barber, Fawcett 1976]."""
    rigid = replace(LAW, friction=0.5)
    springy = replace(
        rigid,
        tangential_stiffness=contact_law(ContactRecipe(), PlateRecipe(), {"tangential_compliance": {"ratio": 1.0}}).tangential_stiffness,
    )
    slips = []
    for law in (rigid, springy):
        done = collide(BALL, dropped((0.3, 0, -1), height_m=RADIUS), FLAT, law, time_s=0.0, gravity_world=NO_GRAVITY)
        slips.append(done.after.v_world[0] - RADIUS * done.after.omega_world[1])
        assert done.impact.tangential_work_J < 0
    assert slips[0] == pytest.approx(0, abs=2e-3 * 0.3)
    assert slips[1] < -0.03


@pytest.mark.parametrize("stiffness", [0.0, LAW.stiffness])
def test_full_sliding_of_a_ball(stiffness: float) -> None:
    """Angles beyond tan = 3.5 mu (1 + e): P = m (1 + e) v_n (-mu, 1), with or without a spring, up to the ball's turn while it touches."""
    law = replace(LAW, restitution=0.8, friction=0.1, tangential_stiffness=stiffness)
    done = collide(BALL, dropped((2.0, 0, -1), height_m=RADIUS), FLAT, law, time_s=0.0, gravity_world=NO_GRAVITY)
    assert done.after.v_world == pytest.approx([2 - 0.1 * 1.8, 0, 0.8], rel=2e-2 if stiffness else 1e-3, abs=1e-9)
    assert done.after.omega_world[1] == pytest.approx(5 * 0.1 * 1.8 / (2 * RADIUS), rel=2e-2 if stiffness else 5e-3)


def test_finer_steps_converge() -> None:
    """Thirty times the step, a hundred times the error at the least; at the usual step 1e-6 of the speed."""
    law = replace(LAW, restitution=0.5, friction=0.2, tangential_stiffness=1.2 * LAW.stiffness)
    errors = []
    for finer in (1 / 30, 1.0):
        states = [dropped((0.5, 0, -speed), (0, 100, 50), height_m=RADIUS) for speed in (0.8, 1.0, 1.3)]
        found, best = (
            [collide(BALL, s, FLAT, law, time_s=0.0, gravity_world=NO_GRAVITY, finer=f).after.v_world for s in states] for f in (finer, 8.0)
        )
        errors.append(np.abs(np.array(found) - np.array(best)).max())
    assert errors[1] < 1e-6
    assert errors[1] < 0.01 * errors[0]
