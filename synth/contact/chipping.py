"""A corner breaks off: vertices beyond a plane across the corner's direction are drawn in to it, along their own rays.

The surface stays closed, and the faces stay what they are. What is left is uniform, of the same density. The chip leaves with the
velocity that its place had, so neither velocity nor spin of the rest changes by it. Valid for bodies that are star-shaped about their
centre of mass; flat faces that lose a corner bend where the mesh is coarse.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synth.effects.links import FlyingBody
from synth.motion.free_flight import Start
from synth.particles.mass_properties import mass_properties


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


def state_of_remnant(state: Start, whole: FlyingBody, rest: FlyingBody) -> Start:
    """The state of ``rest``, a part of ``whole`` that moves on with it."""
    to_world = Rotation.from_quat(state.q_world_body) * Rotation.from_matrix(whole.body.R_particle_body.T)
    arm = to_world.apply(rest.body.com_particle - whole.body.com_particle)
    return Start(
        x_world=state.x_world + arm,
        q_world_body=(to_world * Rotation.from_matrix(rest.body.R_particle_body)).as_quat(),
        v_world=state.v_world + np.cross(state.omega_world, arm),
        omega_world=state.omega_world,
    )
