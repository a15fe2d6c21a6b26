"""Which flights are not fitted to all outline samples, and that the estimate says why."""

from dataclasses import replace

import pytest

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.data.configuration import Configuration, configuration_from_dict
from estimator.measuring.by_samples import left_out
from estimator.measuring.free_flight import estimate
from estimator.particle.observed import observed_particle
from estimator.particle.particle import Particle
from estimator.search.rival_flights import FEW_VIEWS
from synth.sequence import build_silhouette_sequence

RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.6, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=16, speed_ms=(1.5, 2.5), spin_rads=(120.0, 200.0)),
    rig=RigRecipe(drops=3),
)
ALWAYS = Configuration(surface_fit=2)


@pytest.fixture(scope="module")
def seen() -> Observation:
    return build_silhouette_sequence(RECIPE, 0)[0]


@pytest.fixture(scope="module")
def particle(seen: Observation) -> Particle:
    return observed_particle(seen, Configuration())


def test_many_views_are_used(particle: Particle) -> None:
    assert left_out(particle, Configuration()) is None


def test_few_views_are_not(particle: Particle) -> None:
    few = replace(particle, calibrated=particle.calibrated[:FEW_VIEWS])
    assert left_out(few, Configuration()) == (
        "with 16 views intervals of a fit to all outline samples are too narrow; the estimate is that of tangents."
    )
    assert left_out(few, ALWAYS) is None


def test_views_that_disagree_are_used(particle: Particle) -> None:
    apart = replace(particle, disagreement=replace(particle.disagreement, calibration_px=0.2))
    assert left_out(apart, Configuration()) is None


def test_nor_is_a_flight_whose_focal_length_is_measured(particle: Particle) -> None:
    assert "the focal length is measured" in str(left_out(particle, Configuration(focal_prior=0.1)))


def test_who_does_not_ask_for_it_is_told_nothing(particle: Particle) -> None:
    assert not left_out(particle, Configuration(surface_fit=0))


def test_the_estimate_says_why(seen: Observation) -> None:
    found = estimate(seen, Configuration(focal_prior=0.1))
    assert "surface" not in found.statistics
    assert found.statistics["surface_left_out"].startswith("the focal length is measured")


def test_the_switch_has_three_numbers() -> None:
    with pytest.raises(InputError, match="expected surface_fit to be 0 or 1 or 2, got 3"):
        configuration_from_dict({"surface_fit": 3})
