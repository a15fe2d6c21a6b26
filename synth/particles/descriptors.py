"""Shape descriptors of a particle.

* Wadell sphericity ``psi``: surface of the ball of equal volume over the particle's surface [Wadell 1935].
* Convexity ``C = V / V_hull``.
* Elongation ``I/L`` and flatness ``S/I`` [Zingg 1935] from the lengths ``L >= I >= S`` of the box of least volume around the particle.
* Inertia ratios ``I1/I3`` and ``I2/I3``.
* **Irregularity** ``1 - psi C``: 0 for the ball and only for it, towards 1 for flat, branched or jagged bodies. ``psi`` alone hardly
  sees a hollow, ``C`` alone hardly sees a plate; each lies in (0, 1], so each can only add. The surface depends on how finely a rough
  body was scanned, and so do ``psi`` and the irregularity, by some per cent.
"""

import numpy as np
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray


def wadell_sphericity(volume: float, area: float) -> float:
    """Surface of the ball of the same ``volume`` (m³) over ``area`` (m²)."""
    return float(np.pi ** (1 / 3) * (6 * volume) ** (2 / 3) / area)


def box_lengths(mesh: trimesh.Trimesh) -> tuple[float, float, float]:
    """Lengths ``L >= I >= S`` of the box of least volume around the mesh, in its unit."""
    extents = np.sort(trimesh.bounds.oriented_bounds(mesh.convex_hull)[1])
    return float(extents[2]), float(extents[1]), float(extents[0])


def descriptors(mesh: trimesh.Trimesh, inertia_ratios: Float[NDArray[np.float64], "3"]) -> dict[str, float]:
    """All descriptors of a closed, outward mesh; pure numbers, independent of its size."""
    sphericity = wadell_sphericity(mesh.volume, mesh.area)
    convexity = float(mesh.volume / mesh.convex_hull.volume)
    longest, middle, shortest = box_lengths(mesh)
    return {
        "sphericity": sphericity,
        "convexity": convexity,
        "elongation": middle / longest,
        "flatness": shortest / middle,
        "inertia_ratio_1": float(inertia_ratios[0]),
        "inertia_ratio_2": float(inertia_ratios[1]),
        "irregularity": 1 - sphericity * convexity,
    }
