"""Sequences of two particles that collide: what happens in them, and what their pictures show."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.recipes.recipe import ContactRecipe, HsvRecipe, MotionRecipe, PairRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.recipes.toml_files import load_recipe, recipe_from_dict, recipe_to_dict
from datasets.truth import Truth
from synth.contact.polytopes import polytope_of, signed_gap
from synth.effects.links import FlyingBody
from synth.pair_outlines import outlines_of_two
from synth.sequence import build_silhouette_sequence

SMALL = Recipe(
    seed=4,
    particle=ParticleRecipe(irregularity=0.5, size_mm=(4.5, 6.5)),
    motion=MotionRecipe(spin_rads=(40.0, 120.0)),
    rig=RigRecipe(drops=1),
    pair=PairRecipe(closing_ms=(0.8, 1.5), out_of_plane_deg=(0.0, 10.0), frames_before=(12, 14), frames_after=(12, 14)),
    contact=ContactRecipe(restitution=0.7, friction=0.2),
)
SQUARE = np.array([[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]])


@pytest.fixture(scope="module")
def made() -> tuple[Observation, Truth]:
    return build_silhouette_sequence(SMALL, 0)


def parts(truth: Truth) -> tuple[Truth, Truth]:
    assert truth.companion is not None
    return truth, truth.companion


def test_outlines_apart_are_two_the_larger_first() -> None:
    larger, smaller = 1.2 * SQUARE, SQUARE + np.array([40.0, 0.0])
    for order in ((larger, smaller), (smaller, larger)):
        found = outlines_of_two(*order)
        assert [len(points) for points in found] == [4, 4]
        assert np.array_equal(found[0], larger)


@pytest.mark.parametrize("apart", [20.9, 20.0, 15.0])
def test_outlines_that_meet_are_one(apart: float) -> None:
    (found,) = outlines_of_two(SQUARE, SQUARE + np.array([apart, 0.0]))
    area = shapely.area(shapely.Polygon(found))
    assert area == pytest.approx(400 + 20 * min(apart, 20) + 20 * max(apart - 20, 0), rel=1e-3)
    assert np.ptp(found, axis=0) == pytest.approx([20 + apart, 20.0], abs=1e-6)


def test_a_gap_wider_than_a_pixel_is_seen() -> None:
    assert len(outlines_of_two(SQUARE, SQUARE + np.array([21.1, 0.0]))) == 2


def test_bodies_touch_at_the_impact_and_overlap_nowhere(made: tuple[Observation, Truth]) -> None:
    both = parts(made[1])
    shapes = [polytope_of(FlyingBody(t.mesh_vertices, t.body, t.mass_kg, t.inertia_kgm2)) for t in both]

    def gap(poses: list[tuple[np.ndarray, np.ndarray]]) -> float:
        R = [Rotation.from_quat(q).as_matrix() for q, _ in poses]
        return float(signed_gap(shapes[0], R[0], poses[0][1], shapes[1], R[1], poses[1][1])[0])

    assert gap([(t.impacts[0].q_world_body, t.impacts[0].x_world) for t in both]) == pytest.approx(0.0, abs=1e-11)
    for frame in range(len(both[0].motion.times_s)):
        assert gap([(t.motion.q_world_body[frame], t.motion.x_world[frame]) for t in both]) > 0


def test_pictures_show_one_outline_where_they_meet(made: tuple[Observation, Truth]) -> None:
    observation, truth = made
    merged = np.array([outline.empty for outline in observation.further_recordings[0]])
    impact = truth.impacts[0].time_s
    nearest = int(np.argmin(np.abs(observation.clock.times_s - impact)))
    assert merged[max(nearest - 1, 0) : nearest + 2].any()
    assert not merged[:3].any()
    assert not merged[-3:].any()
    assert not any(outline.empty for outline in observation.recordings[0])
    assert observation.companion is not None
    assert len(observation.views) == len(observation.companion.views) == 6


def test_momentum_of_the_pair(made: tuple[Observation, Truth]) -> None:
    first, second = parts(made[1])
    change = [t.mass_kg * (t.impacts[0].v_after - t.impacts[0].v_before) for t in (first, second)]
    gravity = (first.mass_kg + second.mass_kg) * 9.81 * first.impacts[0].duration_s
    assert np.linalg.norm(change[0] + change[1]) < 1.01 * gravity + 1e-12 * np.linalg.norm(change[0])
    assert np.linalg.norm(change[0]) > 0


def test_the_same_seed_makes_the_same(made: tuple[Observation, Truth]) -> None:
    observation, truth = build_silhouette_sequence(SMALL, 0)
    assert np.array_equal(observation.recordings[0][9].points_px, made[0].recordings[0][9].points_px)  # type: ignore[union-attr]
    assert truth.impacts[0].time_s == made[1].impacts[0].time_s
    other, _ = build_silhouette_sequence(replace(SMALL, seed=5), 0)
    assert len(other.clock.times_s) != len(observation.clock.times_s) or not np.array_equal(
        other.recordings[0][9].points_px,
        observation.recordings[0][9].points_px,  # type: ignore[union-attr]
    )


def test_a_pair_that_cannot_be_recorded_says_why() -> None:
    narrow = replace(SMALL, hsv=HsvRecipe(width_px=64, height_px=64))
    with pytest.raises(InputError, match=r"no pair of 60 can be recorded: in \d+ of them one leaves the picture; lower pair\.closing_ms"):
        build_silhouette_sequence(narrow, 0)


def test_the_committed_recipe_and_its_round_trip() -> None:
    recipe = load_recipe(Path(__file__).parents[2] / "scripts" / "acceptance" / "two_particles.toml")
    assert recipe.pair is not None
    assert recipe.plate is None
    assert recipe_from_dict(recipe_to_dict(recipe), "dataset.json") == recipe


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["pair.closing_ms=[2, 1]"], "pair.closing_ms: expected [lowest, highest], got [2, 1]"),
        (["pair.impact_parameter=[0, 2]"], "pair.impact_parameter: expected a value from 0 to 1, got 2"),
        (["pair.frames_before=[10, 10]", "plate.stated=true"], "pair: expected particles that fall on a plate or two that collide"),
        (["pair.drift_ms=[0, 1]", 'tier="rendered"'], 'tier: expected "silhouette" for a pair'),
        (["pair.drift_ms=[0, 1]", "rig.rendered=true"], 'tier: expected "silhouette" for a pair'),
        (["pair.drift_ms=[0, 1]", 'particle.family="sphere"'], "particle.family: expected bodies with edges for a pair"),
        (["pair.drift_ms=[0, 1]", "dropper.runs=3"], "got a pair: a dropper is for a plate"),
        (["pair.drift_ms=[0, 1]", 'effects=[{key = "quadratic_drag", values = {per_length = 1.0}}]'], "effects: expected none on a pair"),
        (["pair.drift_ms=[0, 1]", 'contact_physics=[{key = "chip", values = {depth = 0.1}}]'], "contact_physics: expected adhesion"),
    ],
)
def test_recipes_that_make_no_pair(overrides: list[str], message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        load_recipe(None, overrides)
