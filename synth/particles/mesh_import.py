"""Particles from mesh files (PLY, STL, OBJ): read, checked, and on request repaired.

A particle must be a closed surface with consistent, outward faces, or neither its mass properties nor its outline mean
anything. A file states no unit; a size that no particle has says that the unit was mistaken.
"""

from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh

from datasets.errors import InputError

Unit = Literal["m", "mm", "um", "km", "any"]

METRES = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "km": 1e3, "any": 1.0}
NAMES = {"m": "metres", "mm": "millimetres", "um": "micrometres", "km": "kilometres"}
PLAUSIBLE_M = (1e-5, 0.1)
"""Largest extents that a particle before a camera can have (m)."""
SUFFIXES = (".ply", ".stl", ".obj")


def read_mesh(path: Path, *, repair: bool = False) -> trimesh.Trimesh:
    """Read one closed, outward mesh in the file's own unit.

    Parameters
    ----------
    path
        A PLY, STL or OBJ file.
    repair
        Merge equal vertices, drop degenerate and double faces, keep the largest component, fill holes and make the faces point outward.

    Raises
    ------
    InputError
        Where the file is missing, is no mesh, or is not closed and consistently oriented (after the repair, if asked for).
    """
    try:
        with np.errstate(all="ignore"):
            loaded = _load(path)
            mesh = repaired(loaded) if repair else loaded
            problem = surface_problem(mesh)
    except InputError:
        raise
    except Exception as error:  # trimesh raises whatever its parts raise for a broken surface
        raise InputError(f"{path}: expected a mesh whose surface can be checked; the reader says: {error}") from error
    if problem is None:
        return mesh
    advice = (
        "the repair could not close it: mend it in a mesh editor"
        if repair
        else "type --set particle.repair=true to have it merged, closed and turned outward"
    )
    raise InputError(f"{path}: expected a closed mesh with outward faces, but {problem}; {advice}")


def surface_problem(mesh: trimesh.Trimesh) -> str | None:
    """What keeps a mesh from bounding a volume, in words; ``None`` where nothing does."""
    edges, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    open_edges, crowded = int(np.sum(counts == 1)), int(np.sum(counts > 2))
    if open_edges or crowded:
        crowd = f" and {crowded} edges with more than two faces" if crowded else ""
        return f"it is not watertight: {open_edges} open edges{crowd} among {len(edges)}"
    if not mesh.is_winding_consistent:
        return "its faces are not oriented consistently"
    if mesh.volume <= 0:
        return "its faces point inward (the enclosed volume is negative)"
    return _apart(mesh)


def _apart(mesh: trimesh.Trimesh) -> str | None:
    """Whether more than one body is there: they would be weighed together, but one outline shows only one of them."""
    if mesh.body_count == 1:
        return None
    bodies = sum(part.volume > 0 for part in mesh.split(only_watertight=False, repair=False))
    return f"it holds {bodies} separate bodies" if bodies > 1 else None


def repaired(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Merge vertices, drop degenerate and double faces, keep the largest component, fill holes, turn faces outward."""
    whole = mesh.copy()
    whole.merge_vertices()
    whole.update_faces(whole.unique_faces() & whole.nondegenerate_faces())
    parts: list[Any] = list(whole.split(only_watertight=False))
    largest: trimesh.Trimesh = max(parts, key=lambda part: part.area) if parts else whole
    trimesh.repair.fill_holes(largest)
    trimesh.repair.fix_normals(largest, multibody=False)
    largest.remove_unreferenced_vertices()
    return largest


def metres_per_unit(path: Path, extent: float, unit: Unit) -> float:
    """Length of the file's unit (m), after asking whether a particle of ``extent`` units is plausible.

    Raises
    ------
    InputError
        Where no particle has that size, with the unit that would make it one.
    """
    if unit == "any":
        raise InputError(
            f"{path}: particle.size_mm is [0, 0], so the file's own size counts, but particle.unit is 'any'; expected m, mm, um or km"
        )
    size = extent * METRES[unit]
    if PLAUSIBLE_M[0] <= size <= PLAUSIBLE_M[1]:
        return METRES[unit]
    fitting = [other for other in NAMES if PLAUSIBLE_M[0] <= extent * METRES[other] <= PLAUSIBLE_M[1]]
    guess = f"; that looks like {NAMES[fitting[-1 if size < 1 else 0]]} taken for {NAMES[unit]}" if fitting else ""
    set_unit = f"type --set particle.unit={fitting[0]}, or " if fitting else ""
    raise InputError(
        f"{path}: read in {NAMES[unit]} the particle is {_length(size)} across, expected 0.01 mm to 100 mm{guess}; {set_unit}"
        "set particle.size_mm to the range of sizes wanted"
    )


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{1e3 * metres:.3g} mm"


def _load(path: Path) -> trimesh.Trimesh:
    if not path.is_file():
        raise InputError(f"{path}: expected a mesh file, found none")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: expected a PLY, STL or OBJ file, got '{path.suffix}'")
    try:
        # STL repeats every vertex in every face; other formats are taken as they are, so that checks see the file.
        mesh = trimesh.load_mesh(path, process=False)
        if path.suffix.lower() == ".stl":
            mesh.merge_vertices()
    except Exception as error:
        raise InputError(f"{path}: expected a readable mesh; the reader says: {error}") from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise InputError(f"{path}: expected a mesh with faces, found none")
    if not np.isfinite(mesh.vertices).all():
        bad = int((~np.isfinite(mesh.vertices)).any(axis=1).sum())
        raise InputError(f"{path}: expected finite coordinates, found {bad} vertices without")
    return mesh
