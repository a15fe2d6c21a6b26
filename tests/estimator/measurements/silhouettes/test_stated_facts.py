"""What calibrations say of lengths and gravity, as facts of a campaign."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from estimator.data.configuration import Configuration
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.considered import stated_possible
from estimator.measurements.silhouettes.registration import register
from estimator.measurements.silhouettes.stated_facts import EXACT, stated_facts
from synth.sequence import build_silhouette_sequence
from tests.estimator.measurements.outlines import sampled_campaign

RECIPE = Recipe(
    seed=8,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.4),
    motion=MotionRecipe(frames=12, speed_ms=(1.0, 2.0), spin_rads=(60.0, 120.0)),
    rig=RigRecipe(drops=2),
)


@pytest.fixture(scope="module")
def seen() -> Observation:
    return build_silhouette_sequence(RECIPE, 0)[0]


def test_the_most_uncertain_statement_counts_and_nothing_stated_is_no_fact(seen: Observation) -> None:
    assert stated_facts([seen, replace(seen, gravity_covariance=np.zeros((3, 3)))]) == ()
    (fact,) = stated_facts([seen, replace(seen, sigma_length_scale=1e-3), replace(seen, sigma_length_scale=2e-3)])
    assert fact.effects == ("length_scale",)
    assert fact.sigma == 2e-3
    small, large = (replace(seen, gravity_covariance=each * np.eye(3)) for each in (0.01, 0.04))
    assert [each.sigma for each in stated_facts([small, large, seen])] == pytest.approx([0.2] * 3)


def test_facts_of_gravity_say_its_covariance_and_hold_what_is_stated_as_exact(seen: Observation) -> None:
    turned = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    sigmas = np.array([0.0, 0.05, 0.3])
    stated = turned @ np.diag(sigmas**2) @ turned.T
    facts = stated_facts([replace(seen, gravity_covariance=stated)])
    assert facts[2].words == f"gravity is off by 0 ± 0.3 m/s2 along ({', '.join(f'{each:.3f}' for each in facts[2].weights[0][1])})"
    (possible,) = stated_possible(facts, sampled_campaign.registered().campaign.kind.base, catalogue())
    assert possible.effect.entry.key == "gravity"
    exact = (0.3 * EXACT) ** 2 * np.outer(turned[:, 0], turned[:, 0])
    np.testing.assert_allclose(possible.covariance, stated + exact, atol=1e-12)


def test_a_campaign_has_them(seen: Observation) -> None:
    stated = replace(seen, sigma_length_scale=1e-3, gravity_covariance=0.01 * np.eye(3))
    found = register([stated], Configuration(campaign_surface_fit=0))
    assert found.campaign.facts == stated_facts([stated])
    assert len(found.campaign.facts) == 4
