"""What a contact model knows of the particle: mass, volume and inertia, and its state when it strikes.

Mass and inertia are volume integrals of the mesh, whatever shape a model puts in its place.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.contact.constants import require_positive
from estimator.particle.mass_properties import body_of, solid_of

Array = NDArray[np.float64]
SMALLEST_VOLUME_RATIO = 1e-9
"""A mesh with less than this part of its extent cubed has no inside."""


@dataclass(frozen=True)
class Solid:
    """``mass_kg``, ``volume_m3`` and ``inertia_body`` (3, 3) kg m² about the centre of mass, in the body frame.

    Raises
    ------
    InputError
        Where mass or volume is not above 0, or the inertia is not symmetric and positive definite.
    """

    mass_kg: float
    volume_m3: float
    inertia_body: Array

    def __post_init__(self) -> None:
        require_positive(self.mass_kg, "mass", "kg")
        require_positive(self.volume_m3, "volume", "m³")
        inertia = np.asarray(self.inertia_body, dtype=np.float64)
        if inertia.shape != (3, 3) or not np.isfinite(inertia).all():
            raise InputError(f"inertia: expected 3 x 3 finite numbers, got shape {inertia.shape}")
        moments = np.linalg.eigvalsh(inertia)
        if not np.allclose(inertia, inertia.T, rtol=1e-9, atol=0.0) or moments[0] <= 0.0:
            raise InputError(f"inertia: expected a symmetric matrix with principal moments above 0 kg m², got moments {moments.tolist()}")

    def inertia_world(self, R_world_body: Array) -> Array:
        """Inertia (3, 3) kg m² in the world frame; ``R_world_body`` (3, 3)."""
        return np.asarray(R_world_body @ self.inertia_body @ R_world_body.T)

    @property
    def equivalent_radius_m(self) -> float:
        """Radius (m) of the sphere of the same volume."""
        return float((0.75 * self.volume_m3 / np.pi) ** (1.0 / 3.0))


@dataclass(frozen=True)
class BodyState:
    """Centre of mass ``x_world`` (3,) m, ``R_world_body`` (3, 3), ``v_world`` (3,) m/s and ``omega_world`` (3,) rad/s at one moment."""

    x_world: Array
    R_world_body: Array
    v_world: Array
    omega_world: Array

    def energy_j(self, solid: Solid) -> float:
        """Kinetic energy (J) in the world frame."""
        spin = self.omega_world @ solid.inertia_world(self.R_world_body) @ self.omega_world
        return float(0.5 * (solid.mass_kg * self.v_world @ self.v_world + spin))


@dataclass(frozen=True)
class SolidHull:
    """A solid and ``vertices_body`` (v, 3) m of its convex hull, origin at the centre of mass, axes principal."""

    solid: Solid
    vertices_body: Array


def solid_hull_of(mesh: SurfaceMesh, density_kg_m3: float) -> SolidHull:
    """The solid that fills ``mesh`` uniformly, in the body frame of :func:`body_of`, and its hull's vertices.

    Raises
    ------
    InputError
        Where the density is not above 0, or the mesh holds no volume.
    """
    require_positive(density_kg_m3, "density", "kg/m³")
    volume, extent = _enclosed(mesh), float(np.ptp(mesh.vertices, axis=0).max())
    if not volume > SMALLEST_VOLUME_RATIO * extent**3:
        raise InputError(f"particle mesh: expected a closed surface with a volume, got {volume:.3g} m³ inside an extent of {extent:.3g} m")
    filled = solid_of(mesh)
    body = body_of(mesh)
    largest = float(np.linalg.eigvalsh(np.asarray(filled.moment_inertia))[2])
    solid = Solid(density_kg_m3 * float(filled.volume), float(filled.volume), np.diag(density_kg_m3 * largest * body.inertia_ratios))
    corners = np.asarray(filled.convex_hull.vertices, dtype=np.float64)
    return SolidHull(solid, (corners - body.com_particle) @ body.R_particle_body)


def _enclosed(mesh: SurfaceMesh) -> float:
    """Volume (m³) between the faces and the mean vertex; asked before anything divides by it."""
    a, b, c = np.moveaxis((mesh.vertices - mesh.vertices.mean(axis=0))[mesh.faces], 1, 0)
    return float(abs(np.einsum("fi,fi->", a, np.cross(b, c))) / 6.0)
