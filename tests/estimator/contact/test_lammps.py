"""Hertz–Mindlin spheres side by side with LAMMPS, a public code that shares nothing with ours; skipped where it is not installed."""

import math

import numpy as np
import pytest

from estimator.contact.hertz_mindlin import HertzMindlin
from estimator.contact.solid import BodyState
from scripts.benchmarks.contact_speeds import FLAT
from tests.reference.contact_lammps import Throw, available, thrown
from tests.reference.contact_reference_cases import ELASTIC_SPHERES, TEST_4, TEST_4_FRICTION, ElasticSphere, ObliqueSphere, ball_clump

pytestmark = pytest.mark.skipif(not available(), reason="LAMMPS is not installed; `make lammps` installs it beside the other libraries")


@pytest.mark.parametrize("case", ELASTIC_SPHERES, ids=lambda case: case.name)
def test_elastic_spheres_side_by_side(case: ElasticSphere) -> None:
    law = HertzMindlin(case.young_pa, case.poisson, case.plate_young_pa, case.plate_poisson, 1.0, 0.0)
    ours = law.through(BodyState(np.zeros(3), np.eye(3), np.array([0.0, 0.0, -case.approach_m_s]), np.zeros(3)), ball_clump(case), FLAT)
    theirs = thrown(Throw.of(case), law, case.contact_s)
    assert ours.deepest_m == pytest.approx(theirs.depth_m, rel=1e-6)
    assert ours.duration_s == pytest.approx(theirs.contact_s, rel=1e-6)
    assert theirs.depth_m == pytest.approx(case.depth_m, rel=1e-6)


@pytest.mark.parametrize("case", TEST_4, ids=lambda case: f"{case.angle_deg:g} degrees")
def test_oblique_spheres_side_by_side(case: ObliqueSphere) -> None:
    ball, angle = ELASTIC_SPHERES[4], math.radians(case.angle_deg)
    law = HertzMindlin(ball.young_pa, ball.poisson, math.inf, 0.3, 1.0, TEST_4_FRICTION)
    along, down = 3.9 * math.sin(angle), 3.9 * math.cos(angle)
    ours = law.through(BodyState(np.zeros(3), np.eye(3), np.array([along, 0.0, -down]), np.zeros(3)), ball_clump(ball), FLAT)
    theirs = thrown(Throw.of(ball, along, down), law, ball.contact_s / math.cos(angle) ** 0.2)
    assert ours.after.v_world[0] == pytest.approx(theirs.along_m_s, rel=2e-4)
    assert ours.after.omega_world[1] == pytest.approx(theirs.spin_rad_s, rel=2e-4)
