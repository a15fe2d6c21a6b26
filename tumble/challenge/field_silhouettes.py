"""Silhouettes of a field case: synth's outlines of every flight and calibrated view, with noise as the field has it.

Noise displaces samples along the outline's normal. It is drawn on directions about the outline's middle, so that what is alike over a few
frames lies at the same side of each; whole outlines that are far off are shifted.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.recipes.recipe import EffectRecipe, MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.state import Motion
from synth.frame_outlines import frame_outlines
from synth.plan import SequencePlan
from synth.sequence import exact_view_outlines, observation_of, plan_sequence
from synth.silhouette import outline_mesh
from synth.silhouette.noisy_outline import samples_with_normals
from tumble.challenge.field_case import CALIBRATION, FieldCase, FlightPlan, Scene
from tumble.challenge.field_flights import STATED_S, Flown, nominal_times
from tumble.challenge.field_noise import far_off, heavy_tailed
from tumble.challenge.making import neutral

Array = NDArray[np.float64]
DIRECTIONS = 720
"""On which noise is drawn: about one for each sample of a large outline."""


def scene_of(case: FieldCase) -> Scene:
    """What the silhouettes show.

    Raises
    ------
    ValueError
        Where the case has trajectories.
    """
    if case.scene is None:
        raise ValueError(f"expected silhouettes, got {case.measured}")
    return case.scene


def recipe_of(case: FieldCase, number: int) -> Recipe:
    """Synth's recipe of one flight, with everything that acts in it."""
    scene, flight = scene_of(case), case.flights[number]
    motion = MotionRecipe(flight.rows, flight.rate_hz, _range(scene.speed_ms), _range(scene.spin_rads))
    effects = tuple(EffectRecipe(key, {**values}) for key, values in case.values(number).items() if any(values.values()))
    return Recipe(
        name=case.name,
        seed=case.seed,
        sequences=len(case.flights),
        same_particle=True,
        particle=ParticleRecipe(family=scene.family, irregularity=scene.irregularity),
        motion=motion,
        rig=RigRecipe(drops=scene.drops),
        effects=effects,
    )


def _range(values: tuple[float, ...]) -> tuple[float, float]:
    return values[0], values[1]


def planned(case: FieldCase, number: int) -> SequencePlan:
    """One flight as it happens.

    Raises
    ------
    InputError
        Where no flight stays in the picture.
    """
    return plan_sequence(recipe_of(case, number), number)


def flown_in_pictures(case: FieldCase, number: int, per_row: int) -> Flown:
    """True motion between the first and the last frame, ``per_row`` times as dense, by the recorder's clock."""
    plan, nominal = planned(case, number), nominal_times(case.flights[number], per_row)
    motion = plan.flight.at(plan.effects.true_times(nominal, np.random.default_rng(0)))
    return Flown(nominal, motion, motion.x_world)


def as_flown(case: FieldCase) -> FieldCase:
    """The case with what synth drew: the state of every flight at its first frame, and the body's true axes.

    Raises
    ------
    InputError
        Where a flight does not stay in the picture.
    """
    plans = [planned(case, number) for number in range(len(case.flights))]
    flights = tuple(_at_first_frame(flight, plan.motion) for flight, plan in zip(case.flights, plans, strict=True))
    axes = tuple(tuple(row) for row in plans[0].body.R_particle_body.tolist())
    ratios = plans[0].inertia_kgm2 / plans[0].inertia_kgm2[2]
    return replace(case, flights=flights, ratios=tuple(ratios.tolist()), scene=replace(scene_of(case), R_particle_body=axes))


def _at_first_frame(flight: FlightPlan, motion: Motion) -> FlightPlan:
    v, omega, q = (tuple(each[0].tolist()) for each in (motion.v_world, motion.omega_world, motion.q_world_body))
    return replace(flight, v_world=v, omega_world=omega, q_world_body=q)


def observed(case: FieldCase) -> list[Observation]:
    """What is recorded of every flight, under neutral names; the calibrated views are the same in all."""
    views: tuple[Outline, ...] = ()
    found = []
    for number, flight in enumerate(case.flights):
        plan = planned(case, number)
        noise = case.noise
        if not views:
            rng = np.random.default_rng([case.seed, len(case.flights)])
            views = messy(exact_view_outlines(plan), noise.sigma["view"], 1, 0.0, rng)
        rng = np.random.default_rng([case.seed, number])
        exact = frame_outlines(plan, outline_mesh(plan.vertices, plan.faces))
        frames = messy(exact, noise.sigma["outline"], noise.repeats, noise.outliers, rng)
        seen = _with_stated(neutral(observation_of(plan, (frames,), views), flight.name, len(views)), case)
        if noise.rounded:
            seen = replace(seen, clock=replace(seen.clock, times_s=np.round(seen.clock.times_s / STATED_S) * STATED_S))
        found.append(seen)
    return found


def _with_stated(seen: Observation, case: FieldCase) -> Observation:
    """The observation with how sure its calibration is of what the mess has off by no more than that."""
    sigma = {key: CALIBRATION[key] if key in case.mess else 0.0 for key in CALIBRATION}
    cameras = []
    for camera in seen.cameras:
        lens = camera.intrinsics
        focal = sigma["focal_length"] * np.array([lens.fx_px, lens.fy_px])
        covariance = np.zeros((9, 9))
        covariance[:2, :2], covariance[2, 2], covariance[3, 3] = np.outer(focal, focal), *(sigma["principal_point"] ** 2,) * 2
        cameras.append(replace(camera, lens_covariance=covariance if covariance.any() else None))
    return replace(seen, cameras=tuple(cameras), sigma_length_scale=sigma["length_scale"] or None)


def messy(exact: Iterable[Array], sigma_px: float, repeats: int, outliers: float, rng: np.random.Generator) -> tuple[Outline, ...]:
    """Outlines (n, 2) px with noise that is alike over ``repeats`` of them; a share of ``outliers`` is shifted as a whole."""
    outlines: Sequence[Array] = list(exact)
    field = sigma_px * heavy_tailed(rng, len(outlines), DIRECTIONS, repeats)
    shifts = sigma_px * far_off(rng, rng.random(len(outlines)) < outliers, 2)
    return tuple(_displaced(*each, rng) for each in zip(outlines, field, shifts, strict=True))


def _displaced(exact: Array, field: Array, shift: Array, rng: np.random.Generator) -> Outline:
    if not len(exact):
        return Outline(exact)
    samples, normals = samples_with_normals(exact, spacing_px=NoiseRecipe().spacing_px, phase=rng.random())
    apart = samples - samples.mean(axis=0)
    turn = np.arctan2(apart[:, 1], apart[:, 0]) / (2.0 * np.pi)
    return Outline(samples + normals * field[np.floor(DIRECTIONS * turn).astype(int) % DIRECTIONS][:, None] + shift)
