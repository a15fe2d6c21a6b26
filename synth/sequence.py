"""From a recipe to one sequence: the plan that both tiers share, and the silhouette tier in memory.

World frame: the HSV camera's. Every part draws from a random stream of its own (:mod:`synth.streams`).
"""

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView, Observation
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, NoiseRecipe, Recipe
from datasets.truth import Truth
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline
from synth.motion import FreeFlight, fly, random_start
from synth.motion.random_flight import Stage
from synth.particles.particle import Particle, particle
from synth.plan import SequencePlan, particle_poses_in_camera
from synth.rig import rig_views
from synth.silhouette import OutlineMesh, exact_outline, noisy_outline, outline_mesh
from synth.streams import streams

Array = NDArray[np.float64]


def build_silhouette_sequence(recipe: Recipe, index: int) -> tuple[Observation, Truth]:
    """Sequence ``index`` of ``recipe`` with outlines, stated boundary noise added, and what is true of it.

    Raises
    ------
    InputError
        Where a mesh is bad or no flight fits the picture.
    """
    plan = plan_sequence(recipe, index)
    return silhouette_observation(plan, recipe, index), truth_of(plan)


def plan_sequence(recipe: Recipe, index: int) -> SequencePlan:
    """The particle, its views, the camera and the flight of sequence ``index``; the same for both tiers.

    Raises
    ------
    InputError
        Where a mesh is bad or no flight fits the picture.
    """
    stream = streams(recipe.seed, index)
    body_rng, rig_rng, motion_rng = (np.random.default_rng(s) for s in (stream.particle, stream.rig, stream.motion))
    grain = particle(recipe.particle, index, body_rng)
    camera = hsv_camera(recipe.hsv)
    flight, times = _flight(recipe, grain, camera.intrinsics, motion_rng)
    return SequencePlan(
        name=f"{grain.name}-{index:04d}",
        vertices=grain.vertices,
        faces=grain.faces,
        body=grain.mass.body,
        mass_kg=grain.mass.mass_kg,
        inertia_kgm2=grain.mass.inertia_kgm2,
        material=recipe.particle.material,
        views=rig_views(recipe.rig, grain.mass.body.com_particle, rig_rng),
        hsv=camera,
        clock=Clock(times, recipe.hsv.exposure_us * 1e-6),
        motion=flight.at(times),
        flight=flight,
        gravity_world=np.array(recipe.motion.gravity_ms2),
        symmetries=grain.symmetries,
        descriptors=grain.descriptors,
        particle_name=grain.name,
        notes=grain.notes,
    )


def hsv_camera(recipe: HsvRecipe) -> HsvCamera:
    """The high-speed camera; its principal distance is that of a thin lens focused at ``distance_m``: ``f d / (d - f)``."""
    f, d = recipe.focal_mm * 1e-3, recipe.distance_m
    pitch = recipe.pixel_pitch_um * 1e-6
    focal_px = f * d / (d - f) / pitch
    cx = (recipe.width_px - 1) / 2 + recipe.principal_point_offset_px[0]
    cy = (recipe.height_px - 1) / 2 + recipe.principal_point_offset_px[1]
    intrinsics = Intrinsics(recipe.width_px, recipe.height_px, focal_px, focal_px, cx, cy, recipe.distortion, pitch)
    return HsvCamera("hsv", intrinsics, np.eye(3), np.zeros(3))


def frame_times(recipe: MotionRecipe) -> Array:
    """Times (frame,) s of the frames; the first is zero."""
    return np.arange(recipe.frames) / recipe.frame_rate_hz


def silhouette_observation(plan: SequencePlan, recipe: Recipe, index: int) -> Observation:
    """What the silhouette tier shows of ``plan``: noisy outlines of every frame and every calibrated view."""
    stream = streams(recipe.seed, index)
    mesh = outline_mesh(plan.vertices, plan.faces)
    frames = hsv_outlines(plan, mesh, recipe.noise, np.random.default_rng(stream.hsv_noise))
    views = view_outlines(plan.views, mesh, recipe.noise, np.random.default_rng(stream.rig_noise))
    return Observation(
        name=plan.name,
        cameras=(plan.hsv,),
        recordings=(frames,),
        clock=plan.clock,
        gravity_world=plan.gravity_world,
        views=plan.views,
        view_recording=views,
        mass_kg=plan.mass_kg,
    )


def hsv_outlines(plan: SequencePlan, mesh: OutlineMesh, noise: NoiseRecipe, rng: np.random.Generator) -> tuple[Outline, ...]:
    """The outline of every frame, at the middle of its exposure."""
    R, t = particle_poses_in_camera(plan.body, plan.motion, plan.hsv)
    exact = (exact_outline(mesh, plan.hsv.intrinsics, R[i], t[i]) for i in range(len(R)))
    return tuple(noisy_outline(o, spacing_px=noise.spacing_px, sigma_px=noise.hsv_boundary_px, rng=rng) for o in exact)


def view_outlines(
    views: tuple[CalibratedView, ...], mesh: OutlineMesh, noise: NoiseRecipe, rng: np.random.Generator
) -> tuple[Outline, ...]:
    """The outline of every calibrated view."""
    exact = (exact_outline(mesh, view.intrinsics, view.R_cam_particle, view.t_cam_particle) for view in views)
    return tuple(noisy_outline(o, spacing_px=noise.spacing_px, sigma_px=noise.rig_boundary_px, rng=rng) for o in exact)


def truth_of(plan: SequencePlan) -> Truth:
    """What is true of ``plan``, in the form that is stored."""
    return Truth(
        name=plan.name,
        motion=plan.motion,
        body=plan.body,
        mass_kg=plan.mass_kg,
        inertia_kgm2=plan.inertia_kgm2,
        mesh_vertices=plan.vertices,
        mesh_faces=plan.faces,
        symmetries=plan.symmetries,
        descriptors=plan.descriptors,
        notes={"particle": plan.particle_name, "material": plan.material, **plan.notes},
    )


def _flight(recipe: Recipe, grain: Particle, intrinsics: Intrinsics, rng: np.random.Generator) -> tuple[FreeFlight, Array]:
    times = frame_times(recipe.motion)
    radius = float(np.linalg.norm(grain.vertices - grain.mass.body.com_particle, axis=1).max())
    start = random_start(recipe.motion, Stage(intrinsics, recipe.hsv.distance_m, radius, times), rng)
    exposure = recipe.hsv.exposure_us * 1e-6
    gravity = np.array(recipe.motion.gravity_ms2)
    flight = fly(start, grain.mass.inertia_kgm2, gravity, earliest_s=-exposure, latest_s=times[-1] + exposure)
    return flight, times
