"""Shape descriptors against closed forms and the published figures of the scanned particles."""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from synth.particles.descriptors import descriptors
from synth.particles.mass_properties import mass_properties
from synth.particles.mesh_import import read_mesh

REGULAR = {
    "imaged_bennu_geodesynets": (0.972, 0.952, 0.854, 0.883),
    "imaged_deimos": (0.964, 0.941, 0.659, 0.914),
    "radar_1998ky26": (0.975, 0.968, 0.974, 0.995),
}
IRREGULAR = {
    "stone_02": (0.877, 0.783, 0.414, 0.861),
    "stone_03": (0.891, 0.846, 0.553, 0.830),
    "stone_05": (0.875, 0.777, 0.477, 0.707),
    "stone_09": (0.744, 0.728, 0.429, 0.962),
    "stone_12": (0.829, 0.805, 0.690, 0.874),
    "stone_18": (0.834, 0.742, 0.509, 0.681),
    "savaas_S01": (0.869, 0.771, 0.406, 0.872),
    "savaas_S03": (0.862, 0.780, 0.340, 0.889),
}


def of(mesh: trimesh.Trimesh) -> dict[str, float]:
    return descriptors(mesh, mass_properties(mesh.vertices, np.asarray(mesh.faces), 1.0).body.inertia_ratios)


@lru_cache
def of_file(path: Path) -> dict[str, float]:
    return of(read_mesh(path))


def test_a_box_turned_at_random() -> None:
    box = trimesh.creation.box((4.0, 3.0, 1.5))
    box.apply_transform(np.block([[Rotation.random(rng=np.random.default_rng(2)).as_matrix(), np.zeros((3, 1))], [np.zeros(3), 1]]))
    found = of(box)
    assert found["elongation"] == pytest.approx(0.75, rel=1e-6)
    assert found["flatness"] == pytest.approx(0.5, rel=1e-6)
    assert found["convexity"] == pytest.approx(1.0)
    assert found["sphericity"] == pytest.approx(np.pi ** (1 / 3) * (6 * 18) ** (2 / 3) / (2 * (12 + 6 + 4.5)))


def test_a_ball_is_not_irregular() -> None:
    found = of(trimesh.creation.icosphere(subdivisions=5))
    assert found["irregularity"] == pytest.approx(0, abs=2e-3)
    assert found["elongation"] == pytest.approx(1, abs=2e-3)


def test_descriptors_do_not_depend_on_size() -> None:
    a = trimesh.creation.torus(3.0, 1.0)
    b = a.copy().apply_scale(1e-3)
    assert of(a) == pytest.approx(of(b), rel=1e-5)


@pytest.mark.parametrize("name", [*REGULAR, *IRREGULAR])
def test_published_figures_of_scanned_particles(shared_data: Path, name: str) -> None:
    found = of_file(shared_data / "particles" / f"{name}.ply")
    keys = ("convexity", "sphericity", "inertia_ratio_1", "inertia_ratio_2")
    # The figures have three decimals.
    assert [found[key] for key in keys] == pytest.approx({**REGULAR, **IRREGULAR}[name], abs=1.1e-3)


def test_irregular_bodies_are_more_irregular_than_regular_ones(shared_data: Path) -> None:
    value = {name: of_file(shared_data / "particles" / f"{name}.ply")["irregularity"] for name in (*REGULAR, *IRREGULAR)}
    assert max(value[name] for name in REGULAR) < 0.1
    assert min(value[name] for name in IRREGULAR) > 0.2
