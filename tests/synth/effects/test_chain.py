"""Every effect of the catalogue is realised, changes nothing at zero, and something otherwise."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest
import shapely

from datasets.observation import Observation
from datasets.recipes.effects import KNOWN
from datasets.recipes.recipe import EffectRecipe, MotionRecipe, NoiseRecipe, Recipe, RigRecipe
from datasets.truth import Truth
from datasets.vocabulary.effects import EFFECTS, PICTURED
from synth.effects import REALISATIONS, SYNTH_ONLY
from synth.sequence import build_silhouette_campaign, build_silhouette_sequence, plan_sequence

BASE = Recipe(seed=3, motion=MotionRecipe(frames=6, speed_ms=(1.0, 2.0)), rig=RigRecipe(drops=1))
SEARCHED = {
    "after_frame": 2.0,
    "sigma": 0.0,
    "frequency": 300.0,
    "blur": 0.0,
    "normal_x": 1.0,
    "normal_y": 0.0,
    "normal_z": 0.0,
    "position": -0.1,
    "arm1": 1e-3,
    "arm2": 0.0,
    "arm3": 0.0,
    "time_constant": 1e-3,
}
"""Values of parameters that have to be given."""


def with_effect(key: str, **values: float) -> Recipe:
    """The base recipe with one effect."""
    searched = {name: SEARCHED[name] for name in KNOWN[key].searched}
    return replace(BASE, effects=(EffectRecipe(key, searched | values),))


def everything(observation: Observation, truth: Truth) -> str:
    """A digest of all numbers of a sequence."""
    digest = hashlib.sha256()
    for outline in (*observation.recordings[0], *observation.view_recording):
        digest.update(outline.points_px.tobytes())
    motion, body = truth.motion, truth.body
    for array in (motion.times_s, motion.x_world, motion.q_world_body, motion.v_world, motion.omega_world, body.com_particle):
        digest.update(array.tobytes())
    digest.update(repr((truth.effects, truth.notes, truth.mass_kg)).encode())
    return digest.hexdigest()


@pytest.fixture(scope="module", name="plain")
def plain_digest() -> str:
    return everything(*build_silhouette_sequence(BASE, 0))


def test_every_effect_is_realised() -> None:
    assert set(REALISATIONS) == set(EFFECTS) | set(SYNTH_ONLY)
    assert not set(EFFECTS) & set(SYNTH_ONLY)


@pytest.mark.parametrize("key", [*PICTURED, *SYNTH_ONLY])
def test_an_effect_of_no_size_changes_nothing(key: str, plain: str) -> None:
    recipe = with_effect(key, **dict.fromkeys(KNOWN[key].sizes, 0.0))
    assert everything(*build_silhouette_sequence(recipe, 0)) == plain


@pytest.mark.parametrize("key", [*PICTURED, *SYNTH_ONLY])
def test_an_effect_changes_the_outlines_and_is_recorded(key: str, plain: str) -> None:
    """Ten times the step that is said to move outlines visibly; truth names the effect and its values."""
    recipe = with_effect(key, **{p.name: 10 * p.step for p in KNOWN[key].parameters if p.name in KNOWN[key].sizes})
    observation, truth = build_silhouette_sequence(recipe, 0)
    unperturbed, _ = build_silhouette_sequence(BASE, 0)
    assert everything(observation, truth) != plain
    moved = [
        shapely.hausdorff_distance(*(shapely.linearrings(outline.points_px) for outline in pair))
        for pair in zip(
            (*observation.recordings[0], *observation.view_recording),
            (*unperturbed.recordings[0], *unperturbed.view_recording),
            strict=True,
        )
    ]
    assert max(moved) > 1e-5
    assert set(truth.effects) == {key}
    assert set(truth.effects[key]) == set(KNOWN[key].names)
    np.testing.assert_array_equal(observation.clock.times_s, unperturbed.clock.times_s)
    np.testing.assert_array_equal(observation.gravity_world, unperturbed.gravity_world)
    assert observation.cameras[0].intrinsics == unperturbed.cameras[0].intrinsics


def test_sequences_of_a_campaign_share_particle_and_views() -> None:
    recipe = replace(BASE, sequences=3, same_particle=True)
    campaign = build_silhouette_campaign(recipe)
    first, truth = campaign[0]
    for index, (observation, other) in enumerate(campaign):
        assert everything(observation, other) == everything(*build_silhouette_sequence(recipe, index))
        np.testing.assert_array_equal(other.mesh_vertices, truth.mesh_vertices)
        for k in range(6):
            np.testing.assert_array_equal(observation.views[k].R_cam_particle, first.views[k].R_cam_particle)
            np.testing.assert_array_equal(observation.view_recording[k].points_px, first.view_recording[k].points_px)
    assert len({everything(*sequence) for sequence in campaign}) == 3
    assert everything(first, truth) == everything(*build_silhouette_sequence(BASE, 0))


def test_each_sequence_may_have_its_own_size() -> None:
    effect = EffectRecipe("uniform_acceleration", {"a_x": (1.0, 2.0), "a_y": 0.5})
    plans = [plan_sequence(replace(BASE, sequences=2, effects=(effect,)), index) for index in range(2)]
    assert [plan.effects.values["uniform_acceleration"]["a_x"] for plan in plans] == [1.0, 2.0]
    assert [plan.effects.values["uniform_acceleration"]["a_y"] for plan in plans] == [0.5, 0.5]


def test_an_effect_leaves_the_noise_as_it_was() -> None:
    """The boundary noise of a frame is the same numbers with and without gravity's error."""
    quiet = replace(BASE, noise=NoiseRecipe(hsv_boundary_px=0.0))
    for recipe in (BASE, quiet):
        a, _ = build_silhouette_sequence(recipe, 0)
        b, _ = build_silhouette_sequence(replace(recipe, effects=(EffectRecipe("gravity", {"dg_x": 1e-9}),)), 0)
        np.testing.assert_allclose(a.recordings[0][0].points_px, b.recordings[0][0].points_px, atol=1e-6)
