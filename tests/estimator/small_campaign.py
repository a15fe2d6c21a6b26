"""A campaign small enough for tests: two sequences of 30 frames, 12 views."""

from functools import cache

from datasets.observation import Observation
from datasets.recipes.recipe import EffectRecipe, MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.data.configuration import Configuration
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.silhouettes.registration import register
from synth.sequence import build_silhouette_sequence


def recipe(*effects: EffectRecipe, frames: int = 30, sequences: int = 2) -> Recipe:
    return Recipe(
        seed=5,
        sequences=sequences,
        particle=ParticleRecipe(irregularity=0.6, size_mm=(6.0, 6.0)),
        motion=MotionRecipe(frames=frames, speed_ms=(1.0, 2.0), spin_rads=(100.0, 200.0)),
        rig=RigRecipe(drops=2),
        same_particle=True,
        effects=effects,
    )


@cache
def observations(*, drag: float = 0.0) -> tuple[Observation, ...]:
    effects = (EffectRecipe("quadratic_drag", {"per_length": drag}),) if drag else ()
    made = recipe(*effects)
    return tuple(build_silhouette_sequence(made, i)[0] for i in range(made.sequences))


@cache
def registered(*, drag: float = 0.0) -> Registered:
    return register(list(observations(drag=drag)), Configuration())


@cache
def fitted(*, drag: float = 0.0) -> CampaignFit:
    found = registered(drag=drag)
    return base_fit(found.campaign, found.start)
