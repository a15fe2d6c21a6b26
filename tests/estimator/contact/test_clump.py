"""Clumps: what they take from the mesh, how close their outlines come, what is refused."""

import itertools

import numpy as np
import pytest
import trimesh

from datasets.errors import InputError
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.contact.clump import Clump, clump_within
from estimator.contact.clump_generator import directions_around, generated_clump, outline_error
from estimator.contact.hertz_mindlin import HertzMindlin
from estimator.contact.solid import BodyState, SolidHull, solid_hull_of
from scripts.benchmarks.contact_speeds import FLAT


def _stone() -> SolidHull:
    points = np.random.default_rng(4).normal(size=(40, 3))
    points *= 1e-3 * np.array([1.2, 0.9, 0.7]) / np.linalg.norm(points, axis=1, keepdims=True)
    hull = trimesh.convex.convex_hull(points)
    return solid_hull_of(SurfaceMesh(np.asarray(hull.vertices), np.asarray(hull.faces)), 3515.0)


def test_more_spheres_come_closer_to_the_outline() -> None:
    stone, seen = _stone(), directions_around(500)
    errors = [outline_error(generated_clump(stone, n, smallest_radius_m=2e-5), stone.vertices_body, seen) for n in (1, 4, 16, 50)]
    assert all(after.rms_m < 0.8 * before.rms_m for before, after in itertools.pairwise(errors))
    assert errors[-1].rms_m < 1e-5
    assert errors[-1].largest_m >= errors[-1].rms_m


def test_a_clump_lies_inside_and_keeps_the_mass_of_the_mesh() -> None:
    stone = _stone()
    clump = generated_clump(stone, 30, smallest_radius_m=3e-5)
    assert len(clump.radii) == 30
    assert clump.radii.min() >= 3e-5 * (1 - 1e-6)
    assert clump.solid is stone.solid
    assert (4 / 3 * np.pi * clump.radii**3).sum() > stone.solid.volume_m3
    again = clump_within(stone, clump.centres_body, clump.radii)
    gaps = stone.vertices_body @ directions_around(400).T
    assert ((again.centres_body @ directions_around(400).T + again.radii[:, None]).max(axis=0) <= gaps.max(axis=0) + 1e-12).all()


def test_spheres_outside_the_hull_are_refused() -> None:
    stone = _stone()
    with pytest.raises(InputError, match=r"expected all 2 spheres inside the particle's hull, got 1 outside; sphere 1 stands out by .* µm"):
        clump_within(stone, np.array([[0.0, 0, 0], [1e-3, 0, 0]]), np.array([1e-4, 5e-4]))


def test_impossible_clumps_are_refused() -> None:
    stone = _stone()
    with pytest.raises(InputError, match="radii above 0 m, got a smallest radius of -1"):
        Clump(stone.solid, np.zeros((1, 3)), np.array([-1.0]))
    with pytest.raises(InputError, match="at least one"):
        Clump(stone.solid, np.zeros((0, 3)), np.zeros(0))
    with pytest.raises(InputError, match="expected at least 1 sphere, got 0"):
        generated_clump(stone, 0, smallest_radius_m=1e-5)
    with pytest.raises(InputError, match="expected a smallest radius that fits the hull"):
        generated_clump(stone, 5, smallest_radius_m=2e-3)


def test_fifty_spheres_strike_and_leave() -> None:
    stone = _stone()
    clump = generated_clump(stone, 50, smallest_radius_m=3e-5)
    state = BodyState(np.zeros(3), np.eye(3), np.array([0.3, 0.0, -2.0]), np.array([100.0, 50.0, -80.0]))
    found = HertzMindlin(1143e9, 0.069, 210e9, 0.30, 0.7, 0.12).through(state, clump, FLAT)
    assert found.energy_off < 1e-6
    assert found.after.energy_j(stone.solid) < state.energy_j(stone.solid)
    heights = (found.after.x_world + clump.centres_body @ found.after.R_world_body.T)[:, 2] - clump.radii
    began = (state.x_world + clump.centres_body)[:, 2] - clump.radii
    assert heights.min() == pytest.approx(began.min(), abs=1e-12)
