"""The body of a trajectory: from a mesh, a closed surface in metres, in the tracked frame, uniformly filled; and its axes in words."""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.plausibility import FARTHEST_M
from datasets.trajectory import Trajectory
from datasets.vocabulary.body import Body
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.effects.dependence import of_body
from estimator.effects.registry import MODELS
from estimator.particle.mass_properties import body_of, solid_of

ALONG = 1e-6
"""By how much the cosine between an axis of the body and one of the tracked frame may miss 1 where they are one."""
INSIDE = 1e-6
"""Of a triangle, by which a point may lie outside and count as inside: rounding at the edges between triangles of one face."""


def rest_heights(path: Path) -> NDArray[np.float64]:
    """Heights (h,) m of the centre of mass above a level plane on which the body of a mesh can rest: on faces of its convex hull."""
    from trimesh.triangles import points_to_barycentric  # noqa: PLC0415 - as in read_mesh

    solid = solid_of(read_mesh(path))
    hull, centre = solid.convex_hull, np.asarray(solid.center_mass)
    height = np.einsum("ij,ij->i", hull.face_normals, hull.triangles_center - centre)
    below = centre + height[:, None] * hull.face_normals
    stable = (points_to_barycentric(hull.triangles, below) > -INSIDE).all(axis=1)
    return np.asarray(height[stable])


def body_from_mesh(path: Path) -> Body:
    """Centre of mass, principal axes and inertia ratios of a mesh, which is read by :func:`read_mesh`."""
    return body_of(read_mesh(path))


def read_mesh(path: Path) -> SurfaceMesh:
    """A closed mesh in metres.

    Raises
    ------
    InputError
        Where the file is missing, is no closed mesh, or is not in metres.
    """
    import trimesh  # noqa: PLC0415 - loads networkx: 0.15 s, of no use where no mesh is given

    if not path.is_file():
        raise InputError(f"{path}: expected a mesh (PLY, STL, OBJ), got nothing.")
    try:
        with np.errstate(all="ignore"):
            mesh = trimesh.load(path, force="mesh")
    except Exception as error:  # trimesh raises whatever its readers raise
        raise InputError(f"{path}: expected a mesh (PLY, STL, OBJ), got a file that cannot be read: {error}.") from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
        raise InputError(f"{path}: expected a closed mesh, got one without faces or without finite vertices.")
    reach = float(np.abs(mesh.vertices).max())
    if not reach <= FARTHEST_M:
        raise InputError(f"{path}: expected metres, got a body that reaches {reach:g} m; is it in millimetres?")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)  # a corner with several normals is one point
    if not mesh.is_watertight:
        raise InputError(f"{path}: expected a closed mesh, got one with open edges.")
    return SurfaceMesh(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64))


def axes_words(observations: Mapping[str, Observation | Trajectory], found: Collection[str]) -> Iterator[str]:
    """Which axes of the tracked frame the body's are, whose moments ascend, where values along them are among what was ``found``."""
    of_axes = [key for key in found if key in MODELS and of_body(MODELS[key])]
    turns = [each.surroundings.body.R_particle_body for each in observations.values() if isinstance(each, Trajectory)]
    alike = turns and all(np.allclose(R, turns[0], atol=ALONG) for R in turns)
    if of_axes and alike and not np.allclose(turns[0], np.eye(3), atol=ALONG):
        told = ", ".join(f"{k + 1} is {_along(axis)}" for k, axis in enumerate(turns[0].T))
        yield f"Axes of the body are counted by their moments, the smallest first: of the tracked frame, {told}."


def _along(axis: NDArray[np.float64]) -> str:
    """A direction (3,) as an axis of the tracked frame, or in its coordinates."""
    k = int(np.argmax(np.abs(axis)))
    if abs(axis[k]) > 1.0 - ALONG:
        return f"{'-' if axis[k] < 0.0 else ''}{'xyz'[k]}"
    return f"({', '.join(f'{x:.3f}' for x in axis)})"
