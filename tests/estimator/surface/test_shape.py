"""The shape that views give: it meets their samples to the noise, and a particle file keeps it to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.recipes.recipe import ParticleRecipe, Recipe, RigRecipe
from estimator.data.configuration import Configuration
from estimator.particle.made_once import FittedSurface, MadeOnce, arrays_of, made_of_arrays
from estimator.particle.particle import Particle, particle_of
from estimator.surface import shape as shape_module
from estimator.surface.samples import samples_of_views
from estimator.surface.shape import Shape, made_shape, shape_of
from estimator.surface.star_surface import sphere, sphere_of, star_surface
from synth.sequence import plan_sequence, view_outlines

COARSE, NOISE_PX = 4, 0.2


@pytest.fixture(scope="module")
def particle() -> Particle:
    recipe = Recipe(seed=3, particle=ParticleRecipe(family="cut_stone", irregularity=0.2, size_mm=(6.0, 6.0)), rig=RigRecipe(drops=3))
    plan = plan_sequence(recipe, 0)
    outlines = view_outlines(plan, recipe.noise, np.random.default_rng(1))
    return particle_of(outlines, plan.views, Configuration(hull_resolution=32, directions=50))


@pytest.fixture(scope="module")
def shape(particle: Particle) -> Shape:
    return shape_of(particle, huber=4.0, seed=0, subdivisions=COARSE)


def test_it_meets_the_views_where_the_hull_does_not(particle: Particle, shape: Shape) -> None:
    """By the median: at edges that so coarse a mesh cannot follow a few samples lie far off."""
    seen, to_deviation = (particle.outlines, particle.calibrated), 1.4826
    surfaces = star_surface(particle, subdivisions=COARSE), shape.surface
    hull, fitted = (to_deviation * np.median(np.abs(samples_of_views(s, *seen).gap_px)) for s in surfaces)
    assert fitted < 1.1 * NOISE_PX
    assert fitted < 0.7 * hull


def test_a_particle_file_keeps_it(particle: Particle, shape: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = FittedSurface(shape.surface.vertices, shape.surface.centre, shape.noise_px)
    of_the_particle = particle.once(Configuration(hull_resolution=32, directions=50))
    read = made_of_arrays(arrays_of(replace(of_the_particle, surface=kept)), "here")
    usual = Configuration()
    monkeypatch.setattr(shape_module, "shape_of", lambda _, *, huber, seed: (huber, seed))
    again = made_shape(replace(particle, made=read), huber=usual.huber, seed=usual.seed)
    assert made_shape(replace(particle, made=read), huber=3.0, seed=usual.seed) == (3.0, usual.seed), "not of these settings"
    np.testing.assert_array_equal(again.surface.vertices, shape.surface.vertices)
    assert again.noise_px == shape.noise_px
    assert again.surface.sphere is shape.surface.sphere
    assert made_of_arrays(arrays_of(of_the_particle), "here").surface is None


def test_another_number_of_corners_is_refused(particle: Particle) -> None:
    assert sphere_of(len(sphere(2).directions)) is sphere(2)
    kept = FittedSurface(np.ones((100, 3)), np.zeros(3), 0.2)
    with pytest.raises(InputError, match="expected as many corners as a subdivided icosahedron has, got 100"):
        made_shape(replace(particle, made=MadeOnce(surface=kept)), huber=Configuration().huber, seed=Configuration().seed)
