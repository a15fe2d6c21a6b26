"""Centre of mass, principal axes and inertia ratios of a closed mesh of uniform density (trimesh's volume integrals)."""

from typing import TYPE_CHECKING

import numpy as np

from datasets.vocabulary.body import Body, signed_axes
from datasets.vocabulary.surface_mesh import SurfaceMesh

if TYPE_CHECKING:
    import trimesh


def body_of(mesh: SurfaceMesh) -> Body:
    """The rigid body that fills ``mesh`` uniformly; principal moments ascending, axes signed as :func:`signed_axes` says."""
    solid = solid_of(mesh)
    moments, axes = np.linalg.eigh(np.asarray(solid.moment_inertia, dtype=np.float64))
    return Body(
        com_particle=np.asarray(solid.center_mass, dtype=np.float64),
        R_particle_body=signed_axes(axes),
        inertia_ratios=moments / moments[2],
    )


def largest_moment_per_mass(mesh: SurfaceMesh) -> float:
    """Largest principal moment of inertia over mass (m²) of the uniformly filled ``mesh``."""
    solid = solid_of(mesh)
    return float(np.linalg.eigvalsh(np.asarray(solid.moment_inertia))[2] / solid.volume)


def solid_of(mesh: SurfaceMesh) -> "trimesh.Trimesh":
    """``mesh`` as a closed surface with its outside outward: volume above 0, inertia at unit density."""
    import trimesh  # noqa: PLC0415 - loads networkx: 0.15 s, of no use to trajectories

    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    if solid.volume < 0:
        solid.invert()
    return solid
