"""From a recipe to one sequence: the plan that both tiers share, and the silhouette tier in memory.

World frame: the HSV camera's. Every part draws from a random stream of its own (:mod:`synth.streams`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Observation, Recording
from datasets.recipes.effects import hidden_in_contact, of_one_camera
from datasets.recipes.recipe import MotionRecipe, NoiseRecipe, Recipe
from datasets.truth import Truth
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline
from synth.drops import Drop, frame_counts, planned_drop, random_experiment
from synth.effects import EffectsInForce, FlyingBody, effects_in_force
from synth.frame_outlines import frame_outlines
from synth.further_cameras import filmed, further_filmings
from synth.high_speed_camera import hsv_camera
from synth.pair_sequence import pair_sequence
from synth.particles.particle import Particle, particle
from synth.plan import SequencePlan
from synth.planned_flight import Course, planned_flight
from synth.plate_setting import plate_outline
from synth.rig import rig_views, stated_views
from synth.silhouette import exact_outline, noisy, outline_mesh
from synth.streams import of_camera, streams_of

Array = NDArray[np.float64]


def build_silhouette_sequence(recipe: Recipe, index: int) -> tuple[Observation, Truth]:
    """Sequence ``index`` of ``recipe`` with outlines, stated boundary noise added, and what is true of it.

    Raises
    ------
    InputError
        Where a mesh is bad or no flight fits the picture.
    """
    if recipe.pair is not None:
        return pair_sequence(recipe, index, hsv_camera(recipe.hsv))
    plan = plan_sequence(recipe, index)
    return silhouette_observation(plan, recipe, index), truth_of(plan)


def build_silhouette_campaign(recipe: Recipe) -> list[tuple[Observation, Truth]]:
    """All sequences of ``recipe``; where they are of one particle, they share their calibrated views, which are made once.

    Raises
    ------
    InputError
        Where a mesh is bad or no flight fits the picture.
    """
    if not recipe.same_particle or recipe.pair is not None:
        return [build_silhouette_sequence(recipe, index) for index in range(recipe.sequences)]
    plans = [plan_sequence(recipe, index) for index in range(recipe.sequences)]
    views = view_outlines(plans[0], recipe.noise, np.random.default_rng(streams_of(recipe, 0).rig_noise))
    frames = [outlines_by_camera(plan, recipe, index) for index, plan in enumerate(plans)]
    return [(observation_of(plan, recordings, views), truth_of(plan)) for plan, recordings in zip(plans, frames, strict=True)]


def plan_sequence(recipe: Recipe, index: int) -> SequencePlan:
    """The particle, its views, the camera and the flight of sequence ``index``; the same for both tiers.

    Raises
    ------
    InputError
        Where a mesh is bad or no flight fits the picture.
    """
    stream = streams_of(recipe, index)
    body_rng, rig_rng, motion_rng, effects_rng = (
        np.random.default_rng(s) for s in (stream.particle, stream.rig, stream.motion, stream.effects)
    )
    grain = particle(recipe.particle, _particle_number(recipe, index), body_rng)
    camera, effects = hsv_camera(recipe.hsv), effects_in_force(of_one_camera(recipe.effects, 0), index)
    before, stamps = _frames(recipe, index)
    further = further_filmings(recipe, index, stamps)
    course = replace(_course(recipe, grain, camera.intrinsics, effects, stamps=stamps, rng=effects_rng), further=further)
    drop = None if recipe.plate is None else _drop(recipe, course, grain, index, before=before)
    flight = planned_flight(recipe, course, motion_rng) if drop is None else drop.flight
    flying = course.flying
    plan = SequencePlan(
        name=sequence_name(recipe, grain.name, index),
        vertices=flying.vertices,
        view_vertices=grain.vertices,
        faces=grain.faces,
        body=flying.body,
        mass_kg=flying.mass_kg,
        inertia_kgm2=flying.inertia_kgm2,
        material=recipe.particle.material,
        views=(views := rig_views(recipe.rig, grain.mass.body.com_particle, rig_rng)),
        stated_views=stated_views(recipe.rig, views, grain.vertices, rig_rng),
        hsv=camera,
        true_camera=course.true_camera,
        clock=Clock(course.stamps_s, recipe.hsv.exposure_us * 1e-6),
        true_times_s=course.true_times_s,
        motion=replace(flight.at(course.true_times_s), times_s=course.stamps_s),
        flight=flight,
        gravity_world=np.array(recipe.motion.gravity_ms2),
        symmetries=grain.symmetries,
        descriptors=grain.descriptors,
        effects=effects,
        setting=None if drop is None else drop.setting,
        impacts=() if drop is None else drop.impacts,
        hidden_in_contact=hidden_in_contact(recipe.contact_physics),
        remnant=None if drop is None else drop.remnant,
        chip=None if drop is None else drop.chip,
        particle_name=grain.name,
        notes={**grain.notes, **_experiment_note(recipe, index)},
    )
    return replace(plan, further=tuple(filmed(plan, each, flight) for each in further))


def sequence_name(recipe: Recipe, particle_name: str, index: int) -> str:
    """What sequence ``index`` is called: on a plate by experiment and run."""
    if recipe.plate is None:
        return f"{particle_name}-{index:04d}"
    return f"{particle_name}-e{index // recipe.dropper.runs:02d}-r{index % recipe.dropper.runs:02d}"


def frame_times(recipe: MotionRecipe) -> Array:
    """Times (frame,) s of the frames; the first is zero."""
    return np.arange(recipe.frames) / recipe.frame_rate_hz


def silhouette_observation(plan: SequencePlan, recipe: Recipe, index: int) -> Observation:
    """What the silhouette tier shows of ``plan``: noisy outlines of every frame and every calibrated view."""
    stream = streams_of(recipe, index)
    views = view_outlines(plan, recipe.noise, np.random.default_rng(stream.rig_noise))
    return observation_of(plan, outlines_by_camera(plan, recipe, index), views)


def observation_of(plan: SequencePlan, recordings: Sequence[Recording], view_recording: Recording) -> Observation:
    """What is stated of ``plan``, with the recording of every high-speed camera."""
    return Observation(
        name=plan.name,
        cameras=tuple(each.hsv for each in plan.by_camera),
        recordings=tuple(recordings),
        clock=plan.clock,
        gravity_world=plan.gravity_world,
        views=plan.stated_views,
        view_recording=view_recording,
        mass_kg=plan.mass_kg,
        plate=None if plan.setting is None else plan.setting.stated,
        plate_outlines=() if plan.setting is None else (Outline(plate_outline(plan.setting, plan.hsv, plan.true_camera, 0.0)),),
        camera_clocks=tuple(each.clock for each in plan.by_camera) if plan.further else (),
    )


def outlines_by_camera(plan: SequencePlan, recipe: Recipe, index: int) -> tuple[tuple[Outline, ...], ...]:
    """The outlines that each high-speed camera shows of ``plan``, sequence ``index``."""
    stream = streams_of(recipe, index).hsv_noise
    noises = (np.random.default_rng(of_camera(stream, camera)) for camera in range(len(plan.by_camera)))
    return tuple(hsv_outlines(each, recipe.noise, rng) for each, rng in zip(plan.by_camera, noises, strict=True))


def hsv_outlines(plan: SequencePlan, noise: NoiseRecipe, rng: np.random.Generator) -> tuple[Outline, ...]:
    """The outline of every frame."""
    exact = frame_outlines(plan, outline_mesh(plan.vertices, plan.faces))
    return tuple(noisy(o, noise, noise.hsv_boundary_px, rng) if len(o) else Outline(o) for o in exact)


def view_outlines(plan: SequencePlan, noise: NoiseRecipe, rng: np.random.Generator) -> tuple[Outline, ...]:
    """The outline of every calibrated view."""
    exact = exact_view_outlines(plan)
    return tuple(noisy(o, noise, noise.rig_boundary_px, rng) for o in exact)


def exact_view_outlines(plan: SequencePlan) -> Iterator[Array]:
    """The outline (n, 2) px of every calibrated view, as a segmentation without noise draws it."""
    mesh = outline_mesh(plan.view_vertices, plan.faces)
    for view in plan.views:
        outline = exact_outline(mesh, view.intrinsics, view.R_cam_particle, view.t_cam_particle)
        yield plan.effects.view_segmented(outline, view.intrinsics)


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
        effects={key: dict(values) for key, values in (*plan.effects.values.items(), *plan.hidden_in_contact.items())},
        notes={"particle": plan.particle_name, "material": plan.material, **plan.notes, **_clock_note(plan), **_further_note(plan)},
        plate=None if plan.setting is None else plan.setting.plate,
        impacts=plan.impacts,
        remnant=plan.remnant,
    )


def _clock_note(plan: SequencePlan) -> dict[str, list[float]]:
    """True times (s), where they are not those of the time stamps, under which the motion is stored."""
    wrong = not np.array_equal(plan.true_times_s, plan.clock.times_s)
    return {"true_times_s": plan.true_times_s.tolist()} if wrong else {}


def _further_note(plan: SequencePlan) -> dict[str, list[dict[str, Any]]]:
    """Of every further camera what its clock is off by, and its true times (s)."""
    further = [
        {
            "name": each.hsv.name,
            "clock_offset_s": each.clock_error[0],
            "clock_rate": each.clock_error[1],
            "true_times_s": each.true_times_s.tolist(),
            "effects": {key: dict(values) for key, values in each.effects.values.items()},
        }
        for each in plan.further
    ]
    return {"further_cameras": further} if further else {}


def _particle_number(recipe: Recipe, index: int) -> int:
    if recipe.same_particle:
        return 0
    return index if recipe.plate is None else index // recipe.dropper.runs


def _experiment_note(recipe: Recipe, index: int) -> dict[str, str | int]:
    if recipe.plate is None:
        return {}
    return {"experiment": index // recipe.dropper.runs, "run": index % recipe.dropper.runs}


def _frames(recipe: Recipe, index: int) -> tuple[int, Array]:
    """Frames before the impact (0 without a plate) and the time stamps (frame,) s."""
    if recipe.plate is None:
        return 0, frame_times(recipe.motion)
    before, after = frame_counts(recipe.dropper, np.random.default_rng(streams_of(recipe, index).release))
    return before, np.arange(before + after) / recipe.motion.frame_rate_hz


def _drop(recipe: Recipe, course: Course, grain: Particle, index: int, *, before: int) -> Drop:
    experiment_rng, release_rng = (
        np.random.default_rng(s) for s in (streams_of(recipe, index).experiment, streams_of(recipe, index).motion)
    )
    return planned_drop(recipe, course, grain.faces, random_experiment(recipe, experiment_rng), before=before, rng=release_rng)


def _course(
    recipe: Recipe, grain: Particle, stated: Intrinsics, effects: EffectsInForce, *, stamps: Array, rng: np.random.Generator
) -> Course:
    nominal = FlyingBody(grain.vertices, grain.mass.body, grain.mass.mass_kg, grain.mass.inertia_kgm2)
    return Course(
        stamps_s=stamps,
        true_times_s=effects.true_times(stamps, rng),
        stated_camera=stated,
        true_camera=effects.lens(stated),
        nominal=nominal,
        flying=effects.flying_body(nominal),
        effects=effects,
    )
