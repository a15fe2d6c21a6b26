"""A particle rests where more of the fall is missing than the wobble of a turning outline hides."""

import numpy as np
import pytest

from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.data.configuration import Configuration
from estimator.impacts.chains import Seen
from estimator.measuring import resting
from estimator.measuring.resting import resting_sentence
from estimator.outlines.sightings import tracks_of
from estimator.particle.observed import observed_particle
from synth.sequence import build_silhouette_sequence

RECIPE = Recipe(
    seed=5, particle=ParticleRecipe(family="cut_stone", irregularity=0.6), motion=MotionRecipe(frames=30), rig=RigRecipe(drops=2)
)


@pytest.mark.parametrize(("sag_px", "rests"), [(9.0, True), (4.0, False)])
def test_a_fall_that_wobble_may_hide_is_not_missing(sag_px: float, rests: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two thirds of it are missing, and by 2 px the wobble of a slow turn may bend the path, of which its short wobble says nothing."""
    observation = build_silhouette_sequence(RECIPE, 0)[0]
    seen = Seen(observation, tracks_of(observation), observed_particle(observation, Configuration()))
    wobble_m = 2.0 * 8.0 / np.pi**2 / resting._pixels_per_metre(seen, 0)
    monkeypatch.setattr(resting, "wobble_of", lambda _particle, _rng: wobble_m)
    monkeypatch.setattr(resting, "fall", lambda *_given: (0.33, sag_px, 0.01))
    assert (resting_sentence(seen, [], np.random.default_rng(0)) is not None) is rests
