"""From a recipe to a sequence of two particles that collide, in outlines: observation and truth.

As a sequence of one particle (:mod:`synth.sequence`), with a second particle and a rig's views of it from streams of their own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView, Companion, Observation
from datasets.recipes.effects import hidden_in_contact
from datasets.recipes.recipe import NoiseRecipe, Recipe
from datasets.truth import Impact, Truth
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.state import Motion
from synth.effects.links import FlyingBody
from synth.pair_outlines import outlines_of_two
from synth.pairs import PairCourse, pair_frames, planned_pair
from synth.particles.particle import Particle, particle
from synth.plan import particle_poses_in_camera
from synth.rig import rig_views, stated_views
from synth.silhouette import exact_outline, noisy, outline_mesh
from synth.streams import streams_of

Array = NDArray[np.float64]
NONE = Outline(np.zeros((0, 2)))


@dataclass(frozen=True)
class PlannedGrain:
    """One particle of a pair: what it is, its calibrated views, what is stated of them, its motion at the frames, its impact."""

    grain: Particle
    views: tuple[CalibratedView, ...]
    stated_views: tuple[CalibratedView, ...]
    motion: Motion
    impact: Impact


def pair_sequence(recipe: Recipe, index: int, camera: HsvCamera) -> tuple[Observation, Truth]:
    """Sequence ``index`` of ``recipe`` with noisy outlines, and what is true of it.

    Raises
    ------
    InputError
        Where a mesh is bad or no pair can be recorded.
    """
    assert recipe.pair is not None
    stream, number = streams_of(recipe, index), 0 if recipe.same_particle else 2 * index
    seeds = (stream.particle, stream.second_particle)
    bodies = [particle(recipe.particle, number + k, np.random.default_rng(seed)) for k, seed in enumerate(seeds)]
    before, after = pair_frames(recipe.pair, np.random.default_rng(stream.release))
    rng = np.random.default_rng(stream.motion)
    stamps = np.arange(before + after) / recipe.motion.frame_rate_hz
    impact_s = float((before - 1 + rng.random()) / recipe.motion.frame_rate_hz)
    flying = (_flying(bodies[0]), _flying(bodies[1]))
    pair = planned_pair(recipe, PairCourse(flying, stamps, camera.intrinsics, impact_s), rng)
    rigs = (stream.rig, stream.second_rig)
    planned = [
        PlannedGrain(grain, *_views(recipe, grain, np.random.default_rng(rig)), flight.at(stamps), impact)
        for grain, rig, flight, impact in zip(bodies, rigs, pair.flights, pair.impacts, strict=True)
    ]
    name = f"{bodies[0].name}-pair-{index:04d}"
    clock = Clock(stamps, recipe.hsv.exposure_us * 1e-6)
    recordings = _recorded(planned, camera, recipe.noise, np.random.default_rng(stream.hsv_noise))
    views = [
        _view_outlines(grain, recipe.noise, np.random.default_rng(noise))
        for grain, noise in zip(planned, (stream.rig_noise, stream.second_rig_noise), strict=True)
    ]
    observation = Observation(
        name=name,
        cameras=(camera,),
        recordings=(recordings[0],),
        clock=clock,
        gravity_world=np.array(recipe.motion.gravity_ms2),
        views=planned[0].stated_views,
        view_recording=views[0],
        companion=Companion(planned[1].stated_views, views[1]),
        further_recordings=(recordings[1],),
    )
    second = _truth(name, planned[1], recipe)
    return observation, _truth(name, planned[0], recipe, companion=second)


def _views(recipe: Recipe, grain: Particle, rng: np.random.Generator) -> tuple[tuple[CalibratedView, ...], tuple[CalibratedView, ...]]:
    """The calibrated views, and what is stated of them."""
    views = rig_views(recipe.rig, grain.mass.body.com_particle, rng)
    return views, stated_views(recipe.rig, views, grain.vertices, rng)


def _flying(grain: Particle) -> FlyingBody:
    return FlyingBody(grain.vertices, grain.mass.body, grain.mass.mass_kg, grain.mass.inertia_kgm2)


def _recorded(
    planned: list[PlannedGrain], camera: HsvCamera, noise: NoiseRecipe, rng: np.random.Generator
) -> tuple[tuple[Outline, ...], tuple[Outline, ...]]:
    """The larger and the smaller outline of every frame; the smaller is empty where there is but one."""
    meshes = [outline_mesh(p.grain.vertices, p.grain.faces) for p in planned]
    poses = [particle_poses_in_camera(p.grain.mass.body, p.motion, camera) for p in planned]
    found: tuple[list[Outline], list[Outline]] = ([], [])
    for frame in range(len(planned[0].motion.times_s)):
        exact = [exact_outline(mesh, camera.intrinsics, R[frame], t[frame]) for mesh, (R, t) in zip(meshes, poses, strict=True)]
        seen = [noisy(points, noise, noise.hsv_boundary_px, rng) for points in outlines_of_two(exact[0], exact[1])]
        found[0].append(seen[0])
        found[1].append(seen[1] if len(seen) == 2 else NONE)
    return tuple(found[0]), tuple(found[1])


def _view_outlines(planned: PlannedGrain, noise: NoiseRecipe, rng: np.random.Generator) -> tuple[Outline, ...]:
    mesh = outline_mesh(planned.grain.vertices, planned.grain.faces)
    exact = (exact_outline(mesh, view.intrinsics, view.R_cam_particle, view.t_cam_particle) for view in planned.views)
    return tuple(noisy(o, noise, noise.rig_boundary_px, rng) for o in exact)


def _truth(name: str, planned: PlannedGrain, recipe: Recipe, *, companion: Truth | None = None) -> Truth:
    grain = planned.grain
    return Truth(
        name=name,
        motion=planned.motion,
        body=grain.mass.body,
        mass_kg=grain.mass.mass_kg,
        inertia_kgm2=grain.mass.inertia_kgm2,
        mesh_vertices=grain.vertices,
        mesh_faces=grain.faces,
        symmetries=grain.symmetries,
        descriptors=grain.descriptors,
        effects={key: dict(values) for key, values in hidden_in_contact(recipe.contact_physics).items()},
        notes={"particle": grain.name, "material": recipe.particle.material, **grain.notes},
        impacts=(planned.impact,),
        companion=companion,
    )
