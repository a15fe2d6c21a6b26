"""Sets of measured impacts made from nature itself: true states of drops on a plate, with errors as the silhouette tier leaves them.

The camera, the outlines and the fit of the flight are left out: what they would say of an impact is drawn from a covariance with the
standard deviations that ten sequences of the silhouette tier showed (rounded), the particle's hull and body get errors that all impacts
of a set share, and the plate is the stated one. So a set of ten runs costs a second, and what is tested is the judging of contact models.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.recipes.recipe import ContactRecipe, DropperRecipe, EffectRecipe, ParticleRecipe, PlateRecipe, Recipe
from datasets.truth import Impact, Truth
from datasets.vocabulary.plate import Plate
from estimator.contact.solid import BodyState, Solid, SolidHull
from estimator.contact_validation.measured import HULL_SHARE, MeasuredImpact
from synth.sequence import plan_sequence, truth_of

Array = NDArray[np.float64]
SIGMAS = np.concatenate(
    [
        np.array([15e-6, 15e-6, 520e-6]),
        np.deg2rad([0.1, 0.12, 0.1]),
        np.array([0.3e-3, 1.4e-3, 25e-3]),
        np.array([0.25, 0.3, 0.2]),
        np.array([0.9e-3, 1.6e-3, 40e-3]),
        np.array([0.4, 0.8, 0.7]),
    ]
)
"""Standard deviations of position (m), turn (rad), v (m/s) and omega (rad/s) before, both after; the third of each is the viewing axis."""
CORNER_ERROR_SHARE, INERTIA_ERROR, CENTRE_ERROR_SHARE = 0.002, 0.005, 0.001
"""Errors of the hull's corners and of the centre of mass over the extent, and of the moments of inertia, shared by a set."""
RESTITUTION, FRICTION = (0.4, 0.8), (0.08, 0.5)
"""Ranges that a set's constants are drawn from."""
MOST_RUNS = 60
LEAST_APART_FRAMES = 7.0
"""Impacts nearer to one another are told as a second contact, and not measured."""


def drop_recipe(seed: int, hidden: tuple[EffectRecipe, ...] = ()) -> Recipe:
    """Falls of one particle, each from a height and in an orientation of its own, on a plate of its own tilt.

    Restitution and friction are drawn once.
    """
    rng = np.random.default_rng([seed, 7])
    return Recipe(
        seed=seed,
        sequences=MOST_RUNS,
        same_particle=True,
        particle=ParticleRecipe(irregularity=0.7, size_mm=(5.0, 7.0)),
        plate=PlateRecipe(tilt_deg=(10.0, 30.0)),
        dropper=DropperRecipe(runs=1, height_mm=(40.0, 400.0)),
        contact=ContactRecipe(restitution=float(rng.uniform(*RESTITUTION)), friction=float(rng.uniform(*FRICTION))),
        contact_physics=hidden,
    )


def measured_set(recipe: Recipe, runs: int, rng: np.random.Generator) -> list[MeasuredImpact]:
    """The first impacts of ``runs`` runs as an instrument of the silhouette tier would measure them.

    Runs that touch again within a few frames or stay on the plate are repeated, as whoever drops particles would.
    """
    found: list[MeasuredImpact] = []
    hull: SolidHull | None = None
    for index in range(recipe.sequences):
        try:
            plan = plan_sequence(recipe, index)
        except InputError:
            continue
        truth = truth_of(plan)
        hull = _believed(truth, rng) if hull is None else hull
        if plan.setting is not None and plan.setting.stated is not None and touches_once(truth, recipe.motion.frame_rate_hz):
            found.append(_measured(truth.name, truth.impacts[0], hull, plan.setting.stated, rng))
        if len(found) == runs:
            break
    return found


def touches_once(truth: Truth, frame_rate_hz: float) -> bool:
    """Whether the first impact can be measured by itself: no other follows within :data:`LEAST_APART_FRAMES`."""
    times = [impact.time_s for impact in truth.impacts]
    return len(times) == 1 or (times[1] - times[0]) * frame_rate_hz >= LEAST_APART_FRAMES


def _believed(truth: Truth, rng: np.random.Generator) -> SolidHull:
    """The particle as the calibrated views show it: corners, centre of mass and inertia a little wrong."""
    vertices = (truth.mesh_vertices - truth.body.com_particle) @ truth.body.R_particle_body
    corners = vertices[ConvexHull(vertices).vertices]
    extent = float(np.ptp(corners, axis=0).max())
    corners = corners + CORNER_ERROR_SHARE * extent * rng.normal(size=corners.shape) + CENTRE_ERROR_SHARE * extent * rng.normal(size=3)
    inertia = truth.inertia_kgm2 * (1.0 + INERTIA_ERROR * rng.normal(size=3))
    volume = float(ConvexHull(vertices).volume)
    return SolidHull(Solid(truth.mass_kg, volume, np.diag(inertia)), corners)


def _measured(name: str, impact: Impact, hull: SolidHull, plate: Plate, rng: np.random.Generator) -> MeasuredImpact:
    errors = SIGMAS * rng.normal(size=18)
    R = Rotation.from_rotvec(errors[3:6]).as_matrix() @ Rotation.from_quat(impact.q_world_body).as_matrix()
    state = BodyState(impact.x_world + errors[:3], R, impact.v_before + errors[6:9], impact.omega_before + errors[9:12])
    after = np.concatenate([impact.v_after, impact.omega_after]) + errors[12:]
    extent = float(np.ptp(hull.vertices_body, axis=0).max())
    return MeasuredImpact(name, name, 0, state, after, np.diag(SIGMAS**2), replace(plate), hull, HULL_SHARE * extent)
