"""The sphere-equivalent baseline, the support point and the solid."""

import numpy as np
import pytest
import trimesh

from datasets.errors import InputError
from datasets.vocabulary.plate import Plate
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.contact.solid import BodyState, Solid, solid_hull_of
from estimator.contact.sphere_equivalent import SphereEquivalent, sphere_of
from estimator.contact.stronge_impulse import StrongeImpulse
from estimator.contact.support_point import support_point
from scripts.benchmarks.contact_speeds import FLAT
from tests.estimator.contact.impacts import some_solid


@pytest.mark.parametrize("tangential", [0.3, 6.0])
def test_sphere_equivalent_is_the_impulse_model_on_a_sphere(tangential: float) -> None:
    solid = some_solid()
    state = BodyState(np.zeros(3), np.eye(3), np.array([tangential, 0.2, -1.5]), np.array([40.0, -90.0, 20.0]))
    lever = np.array([0.0, 0.0, -solid.equivalent_radius_m])
    baseline = SphereEquivalent(0.6, 0.2).strike(state, solid, np.array([1e-3, 2e-3, -5e-4]), FLAT)
    followed = StrongeImpulse(0.6, 0.2).strike(state, sphere_of(solid), lever, FLAT)
    np.testing.assert_allclose(baseline.after.v_world, followed.after.v_world, atol=1e-9)
    np.testing.assert_allclose(baseline.after.omega_world, followed.after.omega_world, atol=1e-6)
    assert baseline.sliding == followed.sliding


def test_baselines_refuse_impossible_constants() -> None:
    with pytest.raises(InputError, match=r"restitution: .* got 1\.01"):
        SphereEquivalent(1.01, 0.1)
    with pytest.raises(InputError, match=r"friction coefficient: .* got -1"):
        SphereEquivalent(0.5, -1.0)


def test_baselines_refuse_what_leaves() -> None:
    state = BodyState(np.zeros(3), np.eye(3), np.array([0.0, 0.0, 1.0]), np.zeros(3))
    with pytest.raises(InputError, match="approaches the plate"):
        SphereEquivalent(0.5, 0.1).strike(state, some_solid(), np.array([0.0, 0.0, -1e-3]), FLAT)


def test_support_point_on_an_inclined_plate() -> None:
    normal = np.array([0.6, 0.0, 0.8])
    vertices = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 0, -1.0], [0, 0, 1.0]]) * 1e-3
    state = BodyState(np.array([0.0, 0.0, 5e-3]), np.eye(3), np.zeros(3), np.zeros(3))
    found = support_point(state, vertices, Plate(np.zeros(3), normal))
    np.testing.assert_allclose(found, [0, 0, 4e-3])


def test_solid_of_a_box_has_the_volume_integrals_of_a_box() -> None:
    box = trimesh.creation.box(extents=[1e-3, 2e-3, 3e-3])
    box.apply_translation([1e-3, 1e-3, 1e-3])
    found = solid_hull_of(SurfaceMesh(np.asarray(box.vertices), np.asarray(box.faces)), 3515.0)
    m = 3515.0 * 6e-9
    assert found.solid.mass_kg == pytest.approx(m)
    np.testing.assert_allclose(np.diag(found.solid.inertia_body), m / 12 * np.array([5.0, 10.0, 13.0]) * 1e-6, rtol=1e-9)
    np.testing.assert_allclose(np.sort(np.abs(found.vertices_body), axis=None)[[0, 8, 16]], [0.5e-3, 1e-3, 1.5e-3], rtol=1e-6)


def test_a_flat_mesh_and_an_impossible_solid_are_refused() -> None:
    sheet = SurfaceMesh(np.array([[0.0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]]), np.array([[0, 1, 2], [0, 2, 1]]))
    with pytest.raises(InputError, match="expected a closed surface with a volume"):
        solid_hull_of(sheet, 3515.0)
    with pytest.raises(InputError, match="mass: expected a finite number above 0 kg, got -1"):
        Solid(-1.0, 1.0, np.eye(3))
    with pytest.raises(InputError, match="inertia: expected a symmetric matrix"):
        Solid(1.0, 1.0, -np.eye(3))
