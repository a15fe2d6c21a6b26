"""Known rotation groups are found, and nothing beyond them."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from datasets.vocabulary.frames import geodesic_angle
from synth.particles.family import procedural
from synth.particles.mass_properties import mass_properties
from synth.particles.symmetries import KEPT, rotational_symmetries


def symmetries(mesh: trimesh.Trimesh) -> np.ndarray:
    R = Rotation.random(rng=np.random.default_rng(3)).as_matrix()
    turned = trimesh.Trimesh(mesh.vertices @ R.T + [1.0, 2.0, 3.0], mesh.faces, process=False)
    return rotational_symmetries(turned, mass_properties(turned.vertices, np.asarray(turned.faces), 1.0).body)


@pytest.mark.parametrize(
    ("mesh", "order"),
    [
        (trimesh.creation.box((1.0, 1.5, 2.2)), 4),
        (trimesh.creation.box((1.0, 1.0, 2.0)), 8),
        (trimesh.creation.box((1.0, 1.0, 1.0)), 24),
        (procedural("ellipsoid", 1.0, np.random.default_rng(1)), 4),
        (procedural("jagged", 0.5, np.random.default_rng(1)), 1),
        (procedural("cut_stone", 0.4, np.random.default_rng(1)), 1),
    ],
)
def test_order_of_the_group(mesh: trimesh.Trimesh, order: int) -> None:
    found = symmetries(mesh)
    assert len(found) == order
    np.testing.assert_allclose(found[0], np.eye(3), atol=1e-14)
    products = np.einsum("aij,bjk->abik", found, found).reshape(-1, 1, 3, 3)
    # A product of two symmetries is one again, within the tolerance of 1% of the size.
    assert geodesic_angle(products, found[None]).min(axis=1).max() < np.deg2rad(2)


def test_a_nearly_round_body_where_all_products_fall_back_to_the_identity() -> None:
    found = symmetries_of(procedural("jagged", 0.05, np.random.default_rng(1)))
    np.testing.assert_allclose(found[0], np.eye(3), atol=1e-14)


def symmetries_of(mesh: trimesh.Trimesh) -> np.ndarray:
    return rotational_symmetries(mesh, mass_properties(mesh.vertices, np.asarray(mesh.faces), 1.0).body)


def test_symmetries_map_the_body_on_to_itself() -> None:
    box = trimesh.creation.box((1.0, 1.0, 2.0)).apply_translation([1.0, 2.0, 3.0])
    body = mass_properties(box.vertices, np.asarray(box.faces), 1.0).body
    for R in rotational_symmetries(box, body):
        moved = (box.vertices - body.com_particle) @ R.T + body.com_particle
        nearest = np.linalg.norm(moved[:, None] - box.vertices, axis=2).min(axis=1)
        assert nearest.max() < 0.02


def test_continuous_symmetries_come_out_as_many() -> None:
    assert len(symmetries(trimesh.creation.cylinder(1.0, 3.0, sections=90))) > 150
    assert len(symmetries(procedural("sphere", 0.0, np.random.default_rng(1)))) > KEPT // 2
