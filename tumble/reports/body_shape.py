"""The body as a page shows it in 3D: its surface in body axes, with as few faces as a screen needs."""

from typing import Any

import manifold3d
import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from datasets.vocabulary.surface_mesh import SurfaceMesh
from tumble.reports.packed import LARGEST, packed

MOST_FACES = 1500
"""Faces that a canvas paints in a few milliseconds; an edge is then a few pixels long."""
COARSEST = 0.02
"""Share of the extent by which a surface may be simplified at most."""


def body_shape(surface: SurfaceMesh, body: Body, *, called: str) -> dict[str, Any]:
    """Vertices (steps of ``step_mm``) in body axes and faces, packed, and what a table says of the surface, ``called`` so."""
    import trimesh  # noqa: PLC0415 - loads networkx: 0.15 s, which few pages need

    solid = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    shown = _simplified(surface)
    in_body_mm = 1e3 * (shown.vertices - body.com_particle) @ body.R_particle_body
    reach = float(np.abs(in_body_mm).max())
    extents_mm = 1e3 * np.ptp((surface.vertices - body.com_particle) @ body.R_particle_body, axis=0)
    return {
        "vertices": packed(in_body_mm * (LARGEST / reach)),
        "step_mm": reach / LARGEST,
        "faces": packed(shown.faces),
        "reach_mm": round(float(np.linalg.norm(in_body_mm, axis=1).max()), 4),
        "facts": [
            ["extent along axes 1, 2, 3, mm", ", ".join(f"{extent:.3f}" for extent in extents_mm)],
            ["principal moments over the largest", ", ".join(f"{ratio:.4f}" for ratio in body.inertia_ratios)],
            [f"volume of the {called}, mm³", f"{1e9 * abs(float(solid.volume)):.4g}"],
            ["centre of mass, particle axes, mm", ", ".join(f"{1e3 * x:.3f}" for x in body.com_particle)],
            ["faces shown, of", f"{len(shown.faces)}, {len(surface.faces)}"],
        ],
    }


def _simplified(surface: SurfaceMesh) -> SurfaceMesh:
    """The surface within a tolerance that is doubled until there are few faces; as it is where it is no closed surface."""
    mesh = manifold3d.Mesh64(np.asarray(surface.vertices, dtype=np.float64), np.asarray(surface.faces, dtype=np.uint64))
    solid, extent = manifold3d.Manifold(mesh), float(np.ptp(surface.vertices, axis=0).max())
    if solid.is_empty():
        return surface
    tolerance, found = extent / 4096.0, solid
    while found.num_tri() > MOST_FACES and tolerance < COARSEST * extent:
        found, tolerance = solid.simplify(tolerance), 2.0 * tolerance
    few = found.to_mesh64()
    return SurfaceMesh(np.asarray(few.vert_properties[:, :3], dtype=np.float64), _indices(few.tri_verts))


def _indices(faces: NDArray[Any]) -> NDArray[np.int64]:
    return np.asarray(faces, dtype=np.int64)
