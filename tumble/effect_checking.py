"""Contract checks of one effect on a sequence at hand, or on one that is made up for it."""

from pathlib import Path

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.observation_files import read_observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.configuration import Configuration
from estimator.effects.choosing import chosen_effects
from estimator.effects.contracts import Kept, check_contracts
from estimator.registration import register
from tumble.result_files import observations_in

RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(irregularity=0.6, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=16, speed_ms=(1.0, 2.0), spin_rads=(100.0, 200.0)),
    rig=RigRecipe(drops=2),
)


def check_effect(word: str, source: Path | None) -> tuple[Kept, ...]:
    """The contracts of the effect that ``word`` names, on the first sequence of ``source`` or on a made-up one.

    Raises
    ------
    InputError
        Where there is no such effect, or the sequence cannot be measured.
    """
    (effect, *others) = chosen_effects(word)
    if others:
        raise InputError(f"{word}: expected one effect to check, came {1 + len(others)}.")
    registered = register([_made_up() if source is None else read_observation(observations_in(source)[0])], Configuration())
    if registered.left_out:
        raise InputError(
            f"{registered.left_out[0].name}: cannot be measured, so nothing can be checked on it: {registered.left_out[0].reason}"
        )
    return check_contracts(effect, registered.campaign.sequences[0], registered.start.flights[0])


def _made_up() -> Observation:
    """A short sequence of an irregular stone."""
    from synth.sequence import build_silhouette_sequence  # noqa: PLC0415 - only here is nature needed, and it takes a second to load

    return build_silhouette_sequence(RECIPE, 0)[0]
