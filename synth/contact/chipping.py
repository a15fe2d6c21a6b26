"""A corner breaks off: vertices beyond a plane across the corner's direction are drawn in to it, along their own rays.

The surface stays closed, and the faces stay what they are. What is left is uniform, of the same density, and so is the chip: the solid
between the old surface and the new one. It leaves with the velocity that its place had, so neither velocity nor spin of the rest changes
by it, and they part as spinning bodies do; what it does when it meets the plate is left out. Valid for bodies that are star-shaped about
their centre of mass; flat faces that lose a corner bend where the mesh is coarse.
"""

from dataclasses import dataclass, replace

import numpy as np
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synth.effects.links import FlyingBody
from synth.motion.free_flight import Start
from synth.motion.piecewise_flight import PiecewiseFlight
from synth.particles.mass_properties import mass_properties


@dataclass(frozen=True)
class Chip:
    """What broke off: ``body`` (vertices in the whole's particle frame) with ``faces`` (f, 3), and its ``flight`` from ``from_s`` on."""

    body: FlyingBody
    faces: NDArray[np.int64]
    flight: PiecewiseFlight
    from_s: float


def chipped(body: FlyingBody, faces: NDArray[np.int64], corner_particle: Float[NDArray[np.float64], "3"], depth: float) -> FlyingBody:
    """``body`` without the corner at ``corner_particle`` (m, particle frame): cut at ``1 - depth`` of its distance from the centre."""
    centre = body.body.com_particle
    reach = float(np.linalg.norm(corner_particle - centre))
    arms = body.vertices - centre
    heights = arms @ (corner_particle - centre) / reach
    limit = (1 - depth) * reach
    factor = np.where(heights > limit, limit / np.maximum(heights, limit), 1.0)
    vertices = centre + arms * factor[:, None]
    whole, rest = (mass_properties(points, faces, 1.0) for points in (body.vertices, vertices))
    density = body.mass_kg / whole.mass_kg
    return replace(body, vertices=vertices, body=rest.body, mass_kg=rest.mass_kg * density, inertia_kgm2=rest.inertia_kgm2 * density)


def chip_of(whole: FlyingBody, rest: FlyingBody, faces: NDArray[np.int64]) -> tuple[FlyingBody, NDArray[np.int64]]:
    """What ``rest`` lacks of ``whole``: the body between their surfaces and its faces (f, 3)."""
    drawn_in = np.linalg.norm(whole.vertices - rest.vertices, axis=1) > 1e-9 * np.ptp(whole.vertices)
    changed = faces[np.any(drawn_in[faces], axis=1)]
    shell = np.concatenate([changed, changed[:, ::-1] + len(whole.vertices)])
    mesh = trimesh.Trimesh(np.concatenate([whole.vertices, rest.vertices]), shell, process=False)
    mesh.merge_vertices(digits_vertex=12)
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    vertices, chip_faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    density = whole.mass_kg / mass_properties(whole.vertices, faces, 1.0).mass_kg
    mass = mass_properties(vertices, chip_faces, density)
    return FlyingBody(vertices, mass.body, mass.mass_kg, mass.inertia_kgm2), chip_faces


def state_of_part(state: Start, whole: FlyingBody, rest: FlyingBody) -> Start:
    """The state of ``rest``, a part of ``whole`` that moves on with it."""
    to_world = Rotation.from_quat(state.q_world_body) * Rotation.from_matrix(whole.body.R_particle_body.T)
    arm = to_world.apply(rest.body.com_particle - whole.body.com_particle)
    return Start(
        x_world=state.x_world + arm,
        q_world_body=(to_world * Rotation.from_matrix(rest.body.R_particle_body)).as_quat(),
        v_world=state.v_world + np.cross(state.omega_world, arm),
        omega_world=state.omega_world,
    )
