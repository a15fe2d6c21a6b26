"""What carved hulls say of leaks of light, against the bodies they were carved from."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.configuration import Configuration
from estimator.geometry.outline_shape import as_of_a_hull, outline_shape
from estimator.registration import register
from synth.sequence import build_silhouette_sequence

RECIPE = Recipe(seed=3, motion=MotionRecipe(frames=24, speed_ms=(1.0, 2.0), spin_rads=(100.0, 200.0)), rig=RigRecipe(drops=6))
BODIES = {"stone": ("cut_stone", 0.5), "jagged": ("jagged", 0.5), "very jagged": ("jagged", 0.8)}
DEPTH = 1


@pytest.mark.parametrize("body", BODIES)
def test_nature_varies_as_much_as_a_hull_says_of_it(body: str) -> None:
    """Otherwise the size of a leak, fitted with what the hull says, would be attenuated."""
    family, irregularity = BODIES[body]
    recipe = replace(RECIPE, particle=ParticleRecipe(family=family, irregularity=irregularity))
    quiet = replace(recipe, noise=replace(recipe.noise, hsv_boundary_px=1e-3, spacing_px=0.25))
    exact, _ = build_silhouette_sequence(quiet, 0)
    (sequence,) = register([build_silhouette_sequence(recipe, 0)[0]], Configuration()).campaign.sequences
    frames = sequence.task.sightings.frame
    true = outline_shape([exact.recordings[0][int(k)].points_px for k in frames]).leak[..., DEPTH]
    said = sequence.shape.leak[..., DEPTH]
    assert abs(float(said.mean() - true.mean())) < 0.06
    apart = said - said.mean()
    assert 0.4 < float((apart * (true - true.mean())).sum() / (apart**2).sum()) < 1.8


def test_hollows_draw_leaks_towards_their_mean_and_leave_it() -> None:
    star = 40.0 * np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0.0, 2.0 * np.pi, 10, endpoint=False)])
    star[1::2] *= 0.5
    whole, hollow = [2.0 * star[::2]], [star]
    for polygons, most in ((whole, 1.0), (hollow, 0.2)):
        shape = outline_shape(polygons)
        found = as_of_a_hull(shape, polygons)
        np.testing.assert_allclose(found.leak.mean(axis=(0, 1)), shape.leak.mean(axis=(0, 1)))
        assert float(np.ptp(found.leak[..., DEPTH])) < most * float(np.ptp(shape.leak[..., DEPTH]))
        np.testing.assert_array_equal(found.erosion, shape.erosion)
