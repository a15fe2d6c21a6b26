"""Whole recordings of drops: what runs share, when impacts happen, what is stated, what is seen beside the plate."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
import trimesh

from datasets.errors import InputError
from datasets.recipes.recipe import (
    ContactRecipe,
    DropperRecipe,
    EffectRecipe,
    HsvRecipe,
    MotionRecipe,
    NoiseRecipe,
    ParticleRecipe,
    PlateRecipe,
    Recipe,
    RigRecipe,
)
from datasets.vocabulary.outline import signed_area
from synth.contact.touching import lowest, places_of
from synth.effects.links import FlyingBody
from synth.frame_outlines import frame_outlines
from synth.plan import SequencePlan
from synth.plate_setting import plate_setting, random_stand
from synth.sequence import build_silhouette_sequence, plan_sequence
from synth.silhouette import outline_mesh

RECIPE = Recipe(
    seed=3,
    sequences=10,
    plate=PlateRecipe(tilt_deg=(10.0, 25.0)),
    dropper=DropperRecipe(runs=5, height_mm=(60.0, 120.0)),
    rig=RigRecipe(drops=1),
    noise=NoiseRecipe(hsv_boundary_px=0.0),
)


def with_hidden(key: str, **values: float) -> Recipe:
    return replace(RECIPE, contact_physics=(EffectRecipe(key, values),))


def clearance(plan: SequencePlan, times_s: np.ndarray) -> np.ndarray:
    assert plan.setting is not None
    body = FlyingBody(plan.vertices, plan.body, plan.mass_kg, plan.inertia_kgm2)
    return lowest(plan.flight.at(times_s), places_of(body), plan.setting.plate)


@pytest.fixture(scope="module")
def plan() -> SequencePlan:
    return plan_sequence(RECIPE, 0)


def test_the_first_impact_lies_after_the_frames_before(plan: SequencePlan) -> None:
    dropper, touch = RECIPE.dropper, plan.impacts[0].time_s
    before = int(np.sum(plan.clock.times_s <= touch))
    assert dropper.frames_before[0] <= before <= dropper.frames_before[1]
    assert dropper.frames_after[0] <= len(plan.clock.times_s) - before <= dropper.frames_after[1]
    assert clearance(plan, np.array([touch]))[0] == pytest.approx(0, abs=1e-9)


def test_the_particle_stays_above_the_plate(plan: SequencePlan) -> None:
    """But for the microseconds of a contact, and then by no more than the way that it falls in them."""
    times = np.linspace(0, plan.clock.times_s[-1], 4000)
    heights = clearance(plan, times)
    contact = np.any([(i.time_s < times) & (times < i.time_s + i.duration_s) for i in plan.impacts], axis=0)
    assert heights[~contact].min() > -1e-9
    assert heights.min() > -max(np.linalg.norm(i.v_before) * i.duration_s for i in plan.impacts)
    assert heights[0] > 0.01


def test_the_motion_is_that_of_the_impact_on_both_sides(plan: SequencePlan) -> None:
    impact, parting = plan.impacts[0], plan.impacts[0].time_s + plan.impacts[0].duration_s
    before, after = (plan.flight.at(np.array([t])) for t in (impact.time_s, parting))
    np.testing.assert_allclose(before.v_world[0], impact.v_before, atol=1e-12)
    np.testing.assert_allclose(after.v_world[0], impact.v_after, atol=1e-12)
    np.testing.assert_allclose(after.omega_world[0], impact.omega_after, rtol=1e-9)
    np.testing.assert_allclose(impact.x_world, before.x_world[0], atol=1e-12)


def test_runs_share_the_particle_and_the_plate_and_differ_in_their_release(plan: SequencePlan) -> None:
    run, other = plan_sequence(RECIPE, 3), plan_sequence(RECIPE, 5)
    np.testing.assert_array_equal(run.vertices, plan.vertices)
    np.testing.assert_array_equal(run.views[0].t_cam_particle, plan.views[0].t_cam_particle)
    assert run.setting is not None
    assert plan.setting is not None
    assert other.setting is not None
    for name in ("plate", "stated"):
        for part in ("point_world", "normal_world"):
            np.testing.assert_array_equal(getattr(getattr(run.setting, name), part), getattr(getattr(plan.setting, name), part))
    assert not np.array_equal(run.impacts[0].q_world_body, plan.impacts[0].q_world_body)
    assert not np.array_equal(other.vertices, plan.vertices)
    assert np.abs(other.setting.plate.normal_world - plan.setting.plate.normal_world).max() > 0.003
    assert [p.notes["run"] for p in (plan, run, other)] == [0, 3, 0]
    assert other.notes["experiment"] == 1


def test_a_drop_goes_as_high_as_it_was_released(plan: SequencePlan) -> None:
    speed = np.linalg.norm(plan.impacts[0].v_before)
    assert np.sqrt(2 * 9.80665 * 0.055) < speed < np.sqrt(2 * 9.80665 * 0.13)


def test_the_second_impact_happens_when_the_flat_plate_is_reached_again(tmp_path: Path) -> None:
    """A ball that jumps straight up is back after 2 v / g; it hardly jumps, and gravity is strong, so that this is within the recording."""
    trimesh.creation.icosphere(subdivisions=3).export(tmp_path / "ball.ply")
    recipe = replace(
        RECIPE,
        particle=ParticleRecipe(files=(str(tmp_path / "ball.ply"),), size_mm=(4.0, 4.0)),
        plate=PlateRecipe(tilt_deg=(0.0, 0.0), elevation_deg=0.0),
        dropper=DropperRecipe(
            height_mm=(60.0, 60.0), height_scatter_mm=0.0, spin_rads=(0.0, 0.0), spin_scatter_rads=0.0, frames_after=(45, 45)
        ),
        motion=MotionRecipe(gravity_ms2=(0.0, 60.0, 0.0)),
        contact=ContactRecipe(restitution=0.12, friction=0.0),
    )
    impacts = plan_sequence(recipe, 0).impacts
    assert len(impacts) >= 2
    flown = impacts[1].time_s - impacts[0].time_s - impacts[0].duration_s
    assert flown == pytest.approx(2 * abs(impacts[0].v_after[1]) / 60, rel=1e-2)


def test_a_chip_changes_the_mesh_after_the_impact() -> None:
    recipe = with_hidden("chip", depth=0.25)
    observation, truth = build_silhouette_sequence(recipe, 0)
    whole, _ = build_silhouette_sequence(RECIPE, 0)
    assert truth.remnant is not None
    assert truth.effects["chip"] == {"depth": 0.25}
    assert truth.remnant.mass_kg < truth.mass_kg
    before = int(np.sum(observation.clock.times_s < truth.remnant.time_s))
    for number, (a, b) in enumerate(zip(observation.recordings[0], whole.recordings[0], strict=True)):
        assert (len(a.points_px) == len(b.points_px) and np.array_equal(a.points_px, b.points_px)) == (number < before)


def test_a_chip_is_seen_with_the_particle_until_they_are_apart() -> None:
    recipe = with_hidden("chip", depth=0.25)
    plan = plan_sequence(recipe, 0)
    assert plan.chip is not None
    assert plan.remnant is not None
    after = np.flatnonzero(plan.true_times_s >= plan.remnant.time_s)
    rest_alone = list(frame_outlines(replace(plan, chip=None), outline_mesh(plan.vertices, plan.faces)))
    both = list(frame_outlines(plan, outline_mesh(plan.vertices, plan.faces)))
    larger = np.array([abs(signed_area(both[k])) - abs(signed_area(rest_alone[k])) for k in after])
    assert larger[0] > 5.0
    assert larger.min() > -0.5
    assert np.abs(larger[-5:]).max() < 1e-9
    assert not any(np.array_equal(both[k], rest_alone[k]) for k in after[:2])
    assert all(np.array_equal(both[k], rest_alone[k]) for k in range(after[0]))


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("velocity_dependent_restitution", {"yield_speed": 0.3}),
        ("adhesion", {"pull_off": 0.15, "reach": 2e-5}),
        ("tangential_compliance", {"ratio": 1.0}),
        ("yielding_plate", {"inverse_mass": 2000.0}),
    ],
)
def test_hidden_physics_acts_from_the_impact_on(plan: SequencePlan, key: str, values: dict[str, float]) -> None:
    changed = plan_sequence(with_hidden(key, **values), 0)
    np.testing.assert_array_equal(changed.impacts[0].v_before, plan.impacts[0].v_before)
    assert np.linalg.norm(changed.impacts[0].v_after - plan.impacts[0].v_after) > 0.02


def test_a_tilted_plate_is_not_what_is_stated() -> None:
    recipe = with_hidden("plate_tilt", angle=0.03)
    observation, truth = build_silhouette_sequence(replace(recipe, plate=replace(RECIPE.plate, normal_error_deg=0.0)), 0)
    assert observation.plate is not None
    assert truth.plate is not None
    assert np.arccos(observation.plate.normal_world @ truth.plate.normal_world) == pytest.approx(0.03, rel=1e-6)


def test_the_plate_is_stated_with_its_error_or_not_at_all() -> None:
    assert RECIPE.plate is not None
    turns, offsets = [], []
    for seed in range(400):
        stand = random_stand(RECIPE.plate, np.random.default_rng(seed))
        setting = plate_setting(RECIPE.plate, stand, np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.01, 0.6]), {})
        assert setting.stated is not None
        turns.append(np.linalg.norm(np.cross(setting.stated.normal_world, setting.plate.normal_world)))
        offsets.append(setting.plate.height_m(setting.stated.point_world, 0.0))
    assert np.sqrt(np.mean(np.square(turns)) / 2) == pytest.approx(np.deg2rad(0.1), rel=0.1)
    assert np.std(offsets) == pytest.approx(2e-5, rel=0.1)
    assert setting.stated.offset_sigma_m == 2e-5
    hidden, _ = build_silhouette_sequence(replace(RECIPE, plate=replace(RECIPE.plate, stated=False)), 0)
    assert hidden.plate is None
    assert hidden.plate_outlines[0] is not None


def test_outlines_end_where_the_plate_begins() -> None:
    """From below, the plate hides the foot of the particle in some frames near the impact, and nothing far from it."""
    recipe = replace(RECIPE, plate=replace(RECIPE.plate, elevation_deg=-3.0))
    observation, truth = build_silhouette_sequence(recipe, 0)
    assert observation.plate_outlines[0] is not None
    plate = shapely.Polygon(observation.plate_outlines[0].points_px)
    outlines = [shapely.Polygon(outline.points_px) for outline in observation.recordings[0]]
    overlap = [shapely.intersection(outline, plate).area for outline in outlines]
    assert max(overlap) < 0.01 * outlines[0].area
    cut = np.array([shapely.distance(outline, plate) < 1e-6 for outline in outlines])
    near = np.abs(observation.clock.times_s - truth.impacts[0].time_s) < 3e-4
    assert np.all(cut[near])
    assert not cut[0]


def test_a_moving_plate_is_met_where_it_is() -> None:
    plan = plan_sequence(replace(RECIPE, plate=replace(RECIPE.plate, velocity_ms=(0.1, -0.4, 0.05))), 1)
    assert clearance(plan, np.array([plan.impacts[0].time_s]))[0] == pytest.approx(0, abs=1e-9)
    assert np.linalg.norm(plan.impacts[0].plate_velocity_world - [0.1, -0.4, 0.05]) == 0


def test_drops_that_cannot_be_recorded_say_why() -> None:
    with pytest.raises(InputError, match=r"no release of 30 can be recorded: the particle leaves the picture; lower dropper\.height_mm"):
        plan_sequence(replace(RECIPE, hsv=HsvRecipe(width_px=200, height_px=200)), 0)
