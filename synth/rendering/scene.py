"""The scene: the particle standing still in its own frame, and light all around it; camera, light and plate turn about it.

Moving the camera instead of the particle leaves Mitsuba's search tree as it is from sub-frame to sub-frame (rebuilding it took
longer than rendering). The light is an environment map that turns with the camera, so it is no geometry either.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from synth.rendering.camera import OPENCV_TO_MITSUBA
from synth.rendering.light import Lighting, environment_map
from synth.rendering.materials import Material

Array = NDArray[np.float64]
Pose = tuple[Array, Array]
"""``R_cam_particle`` (3, 3) and ``t_cam_particle`` (3,) m."""

NO_ROULETTE = 1000
"""Path depth from which paths may end at random; beyond all depths, since it would only add noise."""


@dataclass(frozen=True)
class ParticleModel:
    """What is rendered: ``vertices`` (v, 3) m in the particle frame, ``faces`` (f, 3) outward, and the surface."""

    vertices: Float[NDArray[np.float64], "v 3"]
    faces: NDArray[np.int64]
    material: Material


@dataclass(frozen=True)
class Surroundings:
    """What there is besides the particle.

    ``light``, computed for the place ``at_cam`` (3,) m; a ``plate`` that stands still, in the camera frame; a ``chip`` that moves, in the
    particle frame of its own poses.
    """

    light: Lighting
    at_cam: Float[NDArray[np.float64], "3"]
    plate: ParticleModel | None = None
    chip: ParticleModel | None = None

    def depth(self, surface: Material) -> int:
        """Longest path, in segments."""
        return surface.depth if self.plate is None else max(surface.depth, self.plate.material.depth)


def scene_dictionary(mi: Any, particle: ParticleModel, around: Surroundings) -> dict[str, Any]:
    """Mitsuba's description of particle, light and plate."""
    radiance = np.repeat(environment_map(around.light, around.at_cam)[:, :, None], 3, axis=2).astype(np.float32)
    scene = {
        "type": "scene",
        "particle": _mesh(mi, particle, "particle"),
        "light": {"type": "envmap", "bitmap": mi.Bitmap(radiance)},
    }
    others = {"plate": around.plate, "chip": around.chip}
    return {**scene, **{name: _mesh(mi, model, name) for name, model in others.items() if model is not None}}


def positions_of_others(around: Surroundings, pose: Pose, chip: Pose | None) -> dict[str, NDArray[np.float32]]:
    """Vertices, flat, of plate and chip in the particle frame of a ``pose``; ``chip``: that of the chip."""
    seen = {} if around.plate is None else {"plate": around.plate.vertices}
    if around.chip is not None and chip is not None:
        seen["chip"] = around.chip.vertices @ chip[0].T + chip[1]
    return {f"{name}.vertex_positions": ((points - pose[1]) @ pose[0]).astype(np.float32).ravel() for name, points in seen.items()}


def integrator_dictionary(depth: int) -> dict[str, Any]:
    """Path tracing that leaves the background out, so that alpha is the share of a pixel that is covered."""
    return {"type": "path", "max_depth": depth, "rr_depth": NO_ROULETTE, "hide_emitters": True}


COVERAGE_ONLY = {"type": "depth"}
"""An integrator whose alpha is the share that the particle covers, and which casts one ray per sample and no more."""
DULL_RAYS_PER_SHADED_ONE = 4


def rays_per_shaded_one(surface: Material, light: Lighting) -> int:
    """Of how many rays one is shaded: a dull particle before a back light is nearly black, and what varies is what it covers.

    A quarter of the rays leaves matte surfaces (about 0.01 of the background) with a noise of 0.0006, below the sensor's 0.0012.
    Rough metal's would grow from 0.006 to 0.015, above it, so all of its rays are shaded.
    """
    return DULL_RAYS_PER_SHADED_ONE if surface.dull and light.kind == "back" else 1


def light_to_particle(R_cam_particle: Float[NDArray[np.float64], "3 3"]) -> Float[NDArray[np.float64], "4 4"]:
    """The rotation of the environment map into the particle frame."""
    to_world = np.eye(4)
    to_world[:3, :3] = R_cam_particle.T @ OPENCV_TO_MITSUBA
    return to_world


def _mesh(mi: Any, particle: ParticleModel, name: str) -> Any:
    """A body with flat facets."""
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(particle.material.bsdf)
    mesh = mi.Mesh(name, len(particle.vertices), len(particle.faces), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = particle.vertices.astype(np.float32).ravel()
    parameters["faces"] = particle.faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh
