"""One sequence's particle: a shape, scaled, turned and shifted into a particle frame that gives nothing away.

The particle frame is the mesh file's after scaling and centring, turned at random and shifted by about a millimetre: its axes are not
the principal ones, its origin is not the centre of mass.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.names import file_name
from datasets.recipes.recipe import ParticleRecipe
from synth.particles.descriptors import descriptors
from synth.particles.family import procedural
from synth.particles.mass_properties import MassProperties, mass_properties
from synth.particles.mesh_import import metres_per_unit, read_mesh
from synth.particles.symmetries import LARGEST_FINITE, rotational_symmetries

Array = NDArray[np.float64]

FRAME_SHIFT_M = 0.5e-3
"""Standard deviation of the particle frame's origin along each axis."""
OWN_SIZE = (0.0, 0.0)


@dataclass(frozen=True)
class Shape:
    """A body's form, whatever its size: ``vertices`` centred, largest extent 1; ``extent`` in the unit of its file."""

    name: str
    vertices: Array
    faces: NDArray[np.int64]
    extent: float
    descriptors: dict[str, float]
    symmetries: Array


@dataclass(frozen=True)
class Particle:
    """A body in its particle frame: ``vertices`` (v, 3) m, outward ``faces`` (f, 3), and what follows from them."""

    name: str
    vertices: Array
    faces: NDArray[np.int64]
    mass: MassProperties
    descriptors: dict[str, float]
    symmetries: Array
    notes: dict[str, str] = field(default_factory=dict)


def particle(recipe: ParticleRecipe, index: int, rng: np.random.Generator) -> Particle:
    """The particle of sequence ``index``: the files in turn, or a new member of the procedural family.

    Raises
    ------
    InputError
        Where a mesh file is bad or its size implausible.
    """
    shape_seed, size_draw = int(rng.integers(2**63)), float(rng.random())
    R, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(0, FRAME_SHIFT_M, size=3)
    if recipe.files:
        path = Path(recipe.files[index % len(recipe.files)])
        shape = shape_from_file(path, recipe.repair)
    else:
        path = Path(recipe.family)
        shape = shape_of_family(recipe.family, recipe.irregularity, shape_seed)
    size = _size(recipe, path, shape.extent, size_draw)
    vertices = shape.vertices * size @ R.T + shift
    return Particle(
        name=shape.name,
        vertices=vertices,
        faces=shape.faces,
        mass=mass_properties(vertices, shape.faces, recipe.density_kgm3),
        descriptors={**shape.descriptors, "size_m": size},
        symmetries=R @ shape.symmetries @ R.T,
        notes=_notes(shape),
    )


@lru_cache(maxsize=32)
def shape_from_file(path: Path, repair: bool) -> Shape:
    """The form of a mesh file; kept, since many sequences share it."""
    return _shape(file_name(path.stem), read_mesh(path, repair=repair))


@lru_cache(maxsize=32)
def shape_of_family(family: Literal["sphere", "ellipsoid", "cut_stone", "jagged"], irregularity: float, seed: int) -> Shape:
    """The form of a member of the procedural family."""
    return _shape(family, procedural(family, irregularity, np.random.default_rng(seed)))


def _shape(name: str, mesh: trimesh.Trimesh) -> Shape:
    extent = float(mesh.extents.max())
    unit = trimesh.Trimesh((mesh.vertices - mesh.bounds.mean(axis=0)) / extent, mesh.faces, process=False)
    body = mass_properties(unit.vertices, unit.faces, 1.0).body
    return Shape(
        name=name,
        vertices=np.asarray(unit.vertices, dtype=np.float64),
        faces=np.asarray(unit.faces, dtype=np.int64),
        extent=extent,
        descriptors=descriptors(unit, body.inertia_ratios),
        symmetries=rotational_symmetries(unit, body),
    )


def _notes(shape: Shape) -> dict[str, str]:
    if len(shape.symmetries) <= LARGEST_FINITE:
        return {}
    return {"symmetry": "continuous; truth holds a finite sample of its rotations, so an orientation is known only as finely"}


def _size(recipe: ParticleRecipe, path: Path, extent: float, draw: float) -> float:
    """Largest extent (m) along the axes of the mesh file."""
    low, high = recipe.size_mm
    if tuple(recipe.size_mm) != OWN_SIZE:
        return 1e-3 * (low + (high - low) * draw)
    return extent * metres_per_unit(path, extent, recipe.unit)
