"""Mass properties of a homogeneous body from its closed surface.

Volume integrals by the divergence theorem, exact for a polyhedron [Mirtich 1996, J. Graphics Tools 1(2)], as trimesh computes
them. Principal axes are those of the inertia tensor about the centre of mass, in ascending order of the moments, right-handed;
of the four right-handed choices of signs, one is taken by rule. Where moments coincide the axes are arbitrary among the equivalent ones.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.body import Body, signed_axes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MassProperties:
    """``body`` in the mesh's frame, ``mass_kg``, principal moments ``inertia_kgm2`` (3,) ascending, ``volume_m3``."""

    body: Body
    mass_kg: float
    inertia_kgm2: Float[NDArray[np.float64], "3"]
    volume_m3: float


def mass_properties(vertices: Float[NDArray[np.float64], "v 3"], faces: NDArray[np.int64], density_kgm3: float) -> MassProperties:
    """Mass properties of the body inside a closed, outward mesh (m) of homogeneous density (kg/m³)."""
    size = float(np.ptp(vertices, axis=0).max())
    centre = vertices.mean(axis=0)
    unit = trimesh.Trimesh((vertices - centre) / size, faces, process=False)
    moments, axes = np.linalg.eigh(unit.moment_inertia)
    return MassProperties(
        body=Body(
            com_particle=np.asarray(unit.center_mass) * size + centre,
            R_particle_body=signed_axes(axes),
            inertia_ratios=moments / moments[-1],
        ),
        mass_kg=float(unit.volume) * size**3 * density_kgm3,
        inertia_kgm2=moments * size**5 * density_kgm3,
        volume_m3=float(unit.volume) * size**3,
    )
