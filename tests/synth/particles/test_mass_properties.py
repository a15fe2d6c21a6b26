"""Mass properties against closed forms."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from datasets.vocabulary.frames import is_rotation
from synth.particles.family import procedural
from synth.particles.mass_properties import mass_properties


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-6])
def test_a_turned_and_shifted_box(size: float) -> None:
    R, shift = Rotation.random(rng=np.random.default_rng(1)).as_matrix(), np.array([3.0, -2.0, 5.0]) * size
    a, b, c = sides = np.array([3.0, 2.0, 1.0]) * size
    mesh = trimesh.creation.box(sides)
    found = mass_properties(mesh.vertices @ R.T + shift, np.asarray(mesh.faces), 2650.0)
    mass = 2650 * a * b * c
    moments = mass / 12 * np.array([b**2 + c**2, a**2 + c**2, a**2 + b**2])
    assert found.mass_kg == pytest.approx(mass, rel=1e-12)
    np.testing.assert_allclose(found.inertia_kgm2, moments, rtol=1e-10)
    np.testing.assert_allclose(found.body.inertia_ratios, moments / moments[-1], rtol=1e-10)
    np.testing.assert_allclose(found.body.com_particle, shift, atol=1e-10 * size)
    np.testing.assert_allclose(np.abs(R.T @ found.body.R_particle_body), np.eye(3), atol=1e-7)


def test_principal_axes_are_right_handed_ascending_and_make_the_tensor_diagonal() -> None:
    for seed in range(5):
        mesh = procedural("jagged", 0.6, np.random.default_rng(seed))
        found = mass_properties(mesh.vertices, np.asarray(mesh.faces), 1.0)
        R = found.body.R_particle_body
        assert is_rotation(R)
        assert np.all(np.diff(found.body.inertia_ratios) >= 0)
        tensor = R.T @ mesh.moment_inertia @ R
        np.testing.assert_allclose(tensor, np.diag(found.inertia_kgm2), atol=1e-9 * found.inertia_kgm2[-1])
        np.testing.assert_allclose(found.body.com_particle, mesh.center_mass, atol=1e-12)


def test_an_ellipsoid() -> None:
    axes = np.array([3.0, 2.0, 1.5])
    ball = trimesh.creation.icosphere(subdivisions=5)
    found = mass_properties(ball.vertices * axes, np.asarray(ball.faces), 1.0)
    a, b, c = axes
    expected = np.array([b**2 + c**2, a**2 + c**2, a**2 + b**2]) / (a**2 + b**2)
    # An inscribed polyhedron loses about 0.1% of the volume, evenly.
    np.testing.assert_allclose(found.body.inertia_ratios, expected, rtol=1e-4)
    assert found.volume_m3 == pytest.approx(4 / 3 * np.pi * a * b * c, rel=2e-3)
