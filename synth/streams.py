"""Independent random streams of one sequence, so that a change of one part leaves the others as they were."""

from dataclasses import dataclass, replace

import numpy as np

from datasets.recipes.recipe import Recipe

FURTHER_CAMERA = 1_000_003
"""Key of the streams of further high-speed cameras, beyond all numbers of pictures and parts."""


@dataclass(frozen=True)
class Streams:
    """One seed sequence per part of nature; a new part is appended, never inserted."""

    particle: np.random.SeedSequence
    rig: np.random.SeedSequence
    motion: np.random.SeedSequence
    hsv_noise: np.random.SeedSequence
    rig_noise: np.random.SeedSequence
    rendering: np.random.SeedSequence
    effects: np.random.SeedSequence
    experiment: np.random.SeedSequence
    release: np.random.SeedSequence
    second_particle: np.random.SeedSequence
    second_rig: np.random.SeedSequence
    second_rig_noise: np.random.SeedSequence
    clocks: np.random.SeedSequence


def streams(seed: int, index: int, *, same_particle: bool = False) -> Streams:
    """The streams of sequence ``index`` of a benchmark with ``seed``.

    With ``same_particle``, those of the particle, the rig and the rig's noise are those of sequence 0.
    """
    own = Streams(*np.random.SeedSequence([seed, index]).spawn(13))
    if not same_particle:
        return own
    shared = streams(seed, 0)
    second = {"second_particle": shared.second_particle, "second_rig": shared.second_rig, "second_rig_noise": shared.second_rig_noise}
    return replace(own, particle=shared.particle, rig=shared.rig, rig_noise=shared.rig_noise, **second)


def of_camera(stream: np.random.SeedSequence, camera: int) -> np.random.SeedSequence:
    """The part of a stream that belongs to a high-speed camera; the first one's, number 0, is the stream itself."""
    return stream if camera == 0 else np.random.SeedSequence(stream.entropy, spawn_key=(*stream.spawn_key, FURTHER_CAMERA, camera))


def streams_of(recipe: Recipe, index: int) -> Streams:
    """The streams of sequence ``index`` of ``recipe``; on a plate the runs of one experiment share theirs and, at least, the particle."""
    own = streams(recipe.seed, index, same_particle=recipe.same_particle)
    if recipe.plate is None:
        return own
    first = streams(recipe.seed, index - index % recipe.dropper.runs, same_particle=recipe.same_particle)
    return replace(own, particle=first.particle, rig=first.rig, rig_noise=first.rig_noise, experiment=first.experiment)
