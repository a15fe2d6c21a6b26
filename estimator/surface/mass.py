"""Centre of mass and inertia of a uniformly filled surface in a flight's parameters, and their derivatives by its radii."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from estimator.geometry.visual_hull import HullMesh
from estimator.motion.flight import SYMMETRIC
from estimator.particle.mass_properties import solid_of
from estimator.surface.star_surface import StarSurface

Array = NDArray[np.float64]
N_MASS = 8
"""Three numbers of the centre of mass (m), five of the inertia, as in :mod:`estimator.motion.flight`."""


@dataclass(frozen=True)
class MassResponse:
    """``values`` (8,) about a nominal body, and their derivatives ``by_radius`` (n, 8) per m."""

    values: Float[NDArray[np.float64], "8"]
    by_radius: Float[NDArray[np.float64], "n 8"]


def mass_response(surface: StarSurface, nominal: Body) -> MassResponse:
    """Mass properties of a surface as deviations from a ``nominal`` body, in its axes.

    A corner that moves outwards adds a thin layer where it is, a third of the area of every face around it [Mirtich, J. Graphics Tools 1
    (1996) 31, gives the integrals of the solid itself].
    """
    solid = solid_of(HullMesh(surface.vertices, surface.sphere.mesh.faces))
    axes, root = nominal.R_particle_body, np.sqrt(nominal.inertia_ratios)
    centre = np.asarray(solid.center_mass, dtype=np.float64)
    arms = (surface.vertices - centre) @ axes
    layer = np.sum(_area_vectors(surface) * surface.sphere.directions, axis=1)
    by_com = layer[:, None] * arms / solid.volume
    whole = axes.T @ np.asarray(solid.moment_inertia) @ axes / np.outer(root, root)
    square = layer[:, None, None] * (np.sum(arms**2, axis=1)[:, None, None] * np.eye(3) - arms[:, :, None] * arms[:, None, :])
    by_inertia = square / np.outer(root, root)
    scale = whole[2, 2]
    relative = by_inertia / scale - whole * by_inertia[:, 2, 2][:, None, None] / scale**2
    inertia = np.array([(whole / scale - np.eye(3))[i, j] for i, j in SYMMETRIC])
    values = np.concatenate([(centre - nominal.com_particle) @ axes, inertia])
    return MassResponse(values, np.column_stack([by_com, *(relative[:, i, j] for i, j in SYMMETRIC)]))


def _area_vectors(surface: StarSurface) -> Array:
    """A third (n, 3) m² of the areas around each corner, along their outward normals."""
    corners, faces = surface.vertices, surface.sphere.mesh.faces
    a, b, c = (corners[faces[:, k]] for k in range(3))
    area = np.cross(b - a, c - a) / 6.0
    vectors = np.zeros_like(corners)
    for k in range(3):
        np.add.at(vectors, faces[:, k], area)
    return vectors
