"""The procedural family is closed, seeded, smooth, and grows more irregular as asked."""

from typing import get_args

import numpy as np
import pytest

from synth.particles.descriptors import descriptors
from synth.particles.family import Family, procedural
from synth.particles.mass_properties import mass_properties
from synth.particles.mesh_import import surface_problem

FAMILIES = get_args(Family)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("irregularity", [0.0, 0.4, 1.0])
def test_members_are_closed_and_outward(family: Family, irregularity: float) -> None:
    for seed in range(3):
        assert surface_problem(procedural(family, irregularity, np.random.default_rng(seed))) is None


@pytest.mark.parametrize("family", ["ellipsoid", "cut_stone", "jagged"])
def test_measured_irregularity_rises_with_the_one_asked_for(family: Family) -> None:
    measured = []
    for wanted in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0):
        mesh = procedural(family, wanted, np.random.default_rng(4))
        ratios = mass_properties(mesh.vertices, np.asarray(mesh.faces), 1.0).body.inertia_ratios
        measured.append(descriptors(mesh, ratios)["irregularity"])
    assert np.all(np.diff(measured) > 0)
    assert measured[0] < 0.01


@pytest.mark.parametrize("family", ["ellipsoid", "cut_stone", "jagged"])
def test_shape_runs_smoothly(family: Family) -> None:
    def volume(irregularity: float) -> float:
        return float(procedural(family, irregularity, np.random.default_rng(5)).volume)

    coarse = abs(volume(0.5) - volume(0.4))
    fine = abs(volume(0.401) - volume(0.4))
    assert fine < 0.05 * coarse + 1e-3


@pytest.mark.parametrize("family", FAMILIES)
def test_the_seed_decides(family: Family) -> None:
    a, b, c = (procedural(family, 0.5, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a.vertices, b.vertices)
    if family != "sphere":
        assert a.vertices.shape != c.vertices.shape or np.abs(a.vertices - c.vertices).max() > 1e-3


def test_a_cut_stone_is_convex() -> None:
    stone = procedural("cut_stone", 0.8, np.random.default_rng(6))
    assert stone.volume == pytest.approx(stone.convex_hull.volume, rel=1e-9)


def test_irregularity_outside_its_range_is_refused() -> None:
    with pytest.raises(ValueError, match="irregularity"):
        procedural("jagged", 1.2, np.random.default_rng(1))
