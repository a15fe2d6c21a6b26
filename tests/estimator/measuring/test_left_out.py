"""Which flights are not fitted to all outline samples, and that the estimate says why."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.data.configuration import Configuration, configuration_from_dict
from estimator.measuring.by_samples import left_out, left_out_beside_contacts
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


def test_flights_are_fitted_to_samples() -> None:
    assert left_out(Configuration()) is None


def test_few_views_are_used_where_nothing_touches(seen: Observation) -> None:
    few = replace(seen, views=seen.views[:12], view_recording=seen.view_recording[:12])
    assert "surface" in estimate(few, Configuration()).statistics


def test_few_views_are_not_used_beside_contacts(particle: Particle) -> None:
    few = replace(particle, calibrated=particle.calibrated[:FEW_VIEWS])
    assert left_out_beside_contacts(particle, Configuration()) is None
    assert left_out_beside_contacts(few, Configuration()) == (
        "fits to all outline samples were not measured beside contacts with 16 views; the estimate is that of tangents."
    )
    assert left_out_beside_contacts(few, ALWAYS) is None


def test_a_flight_whose_focal_length_is_measured_is_not() -> None:
    assert "the focal length is measured" in str(left_out(Configuration(focal_prior=0.1)))


@pytest.mark.parametrize("why_not", [left_out, lambda asked: left_out_beside_contacts(None, asked)])
def test_who_does_not_ask_for_it_is_told_nothing(why_not: Callable[[Configuration], str | None]) -> None:
    assert not why_not(Configuration(surface_fit=0))


def test_the_estimate_says_why(seen: Observation) -> None:
    found = estimate(seen, Configuration(focal_prior=0.1))
    assert "surface" not in found.statistics
    assert found.statistics["surface_left_out"].startswith("the focal length is measured")


def test_the_switch_has_three_numbers() -> None:
    with pytest.raises(InputError, match="expected surface_fit to be 0 or 1 or 2, got 3"):
        configuration_from_dict({"surface_fit": 3})
