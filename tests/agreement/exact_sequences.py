"""One short sequence as nature makes it, without noise, and the instrument's forward chain at the true state of it.

Outlines are those of the mesh itself: not sampled, not smoothed, no noise, and the calibrated views' as well. So the tangency errors at the
true flight are zero but for rounding, those of an effect that the model leaves out are the effect's own, and those that are left with the
effect in the model are what the reduced model leaves out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.recipes.recipe import EffectRecipe, HsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.body import Body
from datasets.vocabulary.effects import EFFECTS
from datasets.vocabulary.state import Motion
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.appearance.model_errors import ModelErrors, SequenceTask, model_errors
from estimator.appearance.outline_tables import shape_at
from estimator.appearance.prediction import predict
from estimator.appearance.rim import rim_of
from estimator.data.fit_task import FitTask, Prior, Sightings
from estimator.data.views import Views
from estimator.effects.link import Setting
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.geometry.cast_outline import casting_mesh
from estimator.geometry.outline_shape import outline_shape
from estimator.motion.flight import Flight
from synth.frame_outlines import frame_outlines
from synth.plan import SequencePlan
from synth.sequence import plan_sequence
from synth.silhouette import exact_outline, outline_mesh
from tests.estimator.exact import exact_silhouettes, pose_set

Array = NDArray[np.float64]
Values = Mapping[str, float]
FRAMES = 8
RECIPE = Recipe(
    seed=11,
    particle=ParticleRecipe(family="ellipsoid", irregularity=0.7, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=FRAMES, frame_rate_hz=700.0, speed_ms=(2.0, 2.5), spin_rads=(120.0, 150.0), out_of_plane_ms=(1.0, 1.2)),
    hsv=HsvRecipe(exposure_us=100.0),
    rig=RigRecipe(drops=2),
)
"""Ten milliseconds: the particle turns by more than a radian and its depth changes by a centimetre. Its outline has no corners, where a
displacement along the normal would not say where the outline goes."""
RECIPES = {"defocus_growth": replace(RECIPE, motion=replace(RECIPE.motion, frame_rate_hz=250.0))}
"""Depth that changes by three centimetres: curved outlines recede with the square of the blur."""


@dataclass(frozen=True, eq=False)
class Made:
    """A sequence with an effect: nature's ``plan``, the body that the calibrated views show, and outlines, camera after camera."""

    plan: SequencePlan
    nominal: Body
    rings: tuple[Array, ...]
    view_rings: tuple[Array, ...]


def made(key: str, values: Values, recipe: Recipe | None = None, camera: int | None = None) -> Made:
    """The sequence with one effect of these sizes, in one ``camera`` alone or in all; with none of them it is the undisturbed one."""
    return _made(key, tuple(sorted(values.items())), recipe or RECIPES.get(key, RECIPE), camera)


@cache
def _made(key: str, values: tuple[tuple[str, float], ...], recipe: Recipe, camera: int | None) -> Made:
    plan = plan_sequence(replace(recipe, effects=(EffectRecipe(key, dict(values), camera),)), 0)
    nominal = plan_sequence(recipe, 0)
    same_start = zip(vars(at(plan, 0.0)).values(), vars(at(nominal, 0.0)).values(), strict=True)
    assert all(np.allclose(a, b, rtol=1e-9, atol=1e-12) for a, b in same_start), "another start was drawn: choose a weaker effect"
    views = outline_mesh(plan.view_vertices, plan.faces)
    return Made(
        plan,
        nominal.body,
        tuple(convex(ring) for each in plan.by_camera for ring in frame_outlines(each, outline_mesh(plan.vertices, plan.faces))),
        tuple(
            convex(plan.effects.view_segmented(exact_outline(views, v.intrinsics, v.R_cam_particle, v.t_cam_particle), v.intrinsics))
            for v in plan.views
        ),
    )


def convex(ring: Array) -> Array:
    """The corners of a ring's convex hull (px), in their order."""
    return np.asarray(ring[ConvexHull(ring).vertices])


def at(plan: SequencePlan, time_s: float) -> Motion:
    """The true motion at one true time."""
    return plan.flight.at(np.array([time_s]))


def true_flight(sequence: Made, time_s: float) -> Flight:
    """The state of nature at a true time, as the instrument's flight of the nominal body."""
    motion = at(sequence.plan, time_s)
    return Flight(
        time_s=time_s,
        x=motion.x_world[0],
        q=motion.q_world_body[0],
        v=motion.v_world[0],
        omega=motion.omega_world[0],
        body=sequence.nominal,
        com=np.zeros(3),
        inertia=np.zeros(5),
        offset_px=0.0,
        gravity_world=sequence.plan.gravity_world,
    )


def setting_of(sequence: Made) -> Setting:
    """What the observation states beside its outlines."""
    plan = sequence.plan
    clocks = {further.hsv.name: further.clock for further in plan.further}
    return Setting(plan.clock.times_s, plan.clock.exposure_s, plan.gravity_world, sequence.nominal.inertia_ratios, clocks=clocks)


@cache
def task_of(sequence: Made) -> SequenceTask:
    """What the instrument would fit to, of exact outlines, which nobody sampled."""
    plan, count = sequence.plan, len(sequence.rings)
    camera = np.repeat(np.arange(len(plan.by_camera)), [len(each.clock.times_s) for each in plan.by_camera])
    lenses = [plan.by_camera[c].hsv.intrinsics for c in camera]
    sightings = Sightings(
        replace(exact_silhouettes(sequence.rings, lenses), samples=np.zeros(count, dtype=np.int64)),
        camera,
        np.concatenate([np.arange(len(each.clock.times_s)) for each in plan.by_camera]),
        np.concatenate([each.clock.times_s for each in plan.by_camera]),
        tuple(each.hsv for each in plan.by_camera),
    )
    seen = exact_silhouettes(sequence.view_rings, [v.intrinsics for v in plan.views])
    views = Views(seen, pose_set(plan.views), sequence.nominal.com_particle)
    task = FitTask(sightings, views, Prior(1e-4, 0.1, 0.01, 1.0), 10.0, np.ones((count, len(plan.views))))
    vertices = (plan.view_vertices - sequence.nominal.com_particle) @ sequence.nominal.R_particle_body
    flight, setting = true_flight(sequence, 0.0), setting_of(sequence)
    made = SequenceTask("exact", task, setting, rim_of(vertices), outline_shape([]))
    prediction = predict(flight, Model(), np.zeros(0), setting, sightings.times_s)
    _, shape = shape_at(made, flight, prediction, casting_mesh(SurfaceMesh(plan.view_vertices, plan.faces)))
    return replace(made, shape=shape)


def theta_of(key: str, values: Values) -> Array:
    """Parameters in the order of the catalogue; what is left out is 0."""
    return np.array([values.get(name, 0.0) for name in EFFECTS[key].names])


def errors_at(sequence: Made, key: str, values: Values, *, time_s: float = 0.0) -> ModelErrors:
    """Tangency errors at the flight that is true at ``time_s``, with one effect of these sizes in the model."""
    return _errors_at(sequence, key, tuple(theta_of(key, values)), time_s)


@cache
def _errors_at(sequence: Made, key: str, theta: tuple[float, ...], time_s: float) -> ModelErrors:
    return model_errors(task_of(sequence), true_flight(sequence, time_s), Model((MODELS[key],)), np.array(theta))


def rms(errors: ModelErrors) -> float:
    """RMS (px) of the errors that are seen."""
    return float(np.sqrt(np.mean(errors.e[errors.seen] ** 2)))
