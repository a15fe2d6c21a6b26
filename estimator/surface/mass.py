"""Centre of mass and inertia of a uniformly filled surface in a flight's parameters, and their derivatives by its corners."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from estimator.geometry.visual_hull import HullMesh
from estimator.motion.flight import SYMMETRIC
from estimator.particle.mass_properties import solid_of
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]
N_MASS = 8
"""Three numbers of the centre of mass (m), five of the inertia, as in :mod:`estimator.motion.flight`."""


@dataclass(frozen=True)
class MassResponse:
    """``values`` (8,) about a nominal body, and their derivatives ``by_corner`` (3 n, 8) per m of each corner's three coordinates."""

    values: Float[NDArray[np.float64], "8"]
    by_corner: Float[NDArray[np.float64], "3n 8"]


def mass_response(surface: Surface, nominal: Body) -> MassResponse:
    """Mass properties of a surface as deviations from a ``nominal`` body, in its axes.

    A corner that moves adds a thin layer where it is, along the normals of a third of the area of every face around it [Mirtich, J.
    Graphics Tools 1 (1996) 31, gives the integrals of the solid itself].
    """
    solid = solid_of(HullMesh(surface.vertices, surface.sphere.mesh.faces))
    axes, root = nominal.R_particle_body, np.sqrt(nominal.inertia_ratios)
    centre = np.asarray(solid.center_mass, dtype=np.float64)
    arms = (surface.vertices - centre) @ axes
    by_com = arms / solid.volume
    whole = axes.T @ np.asarray(solid.moment_inertia) @ axes / np.outer(root, root)
    square = np.sum(arms**2, axis=1)[:, None, None] * np.eye(3) - arms[:, :, None] * arms[:, None, :]
    by_inertia = square / np.outer(root, root)
    scale = whole[2, 2]
    relative = by_inertia / scale - whole * by_inertia[:, 2, 2][:, None, None] / scale**2
    inertia = np.array([(whole / scale - np.eye(3))[i, j] for i, j in SYMMETRIC])
    per_volume = np.column_stack([by_com, *(relative[:, i, j] for i, j in SYMMETRIC)])
    values = np.concatenate([(centre - nominal.com_particle) @ axes, inertia])
    return MassResponse(values, (surface.area_vectors[:, :, None] * per_volume[:, None, :]).reshape(-1, N_MASS))
