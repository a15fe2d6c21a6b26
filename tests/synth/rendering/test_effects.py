"""Rendered effects: edges of pictures lie where the silhouette tier, which knows no rays and no pixels, has its outlines."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from datasets.errors import InputError
from datasets.recipes.recipe import EffectRecipe, HsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RenderingRecipe, RigRecipe
from synth.frame_outlines import frame_outlines
from synth.plan import SequencePlan
from synth.rendering.exposure import background_light, compose
from synth.rendering.sequence import Studio
from synth.rendering.shooting import take, toned
from synth.rendering.shots import Shot, frame_shots, hsv_optics, picture_stream, view_shots
from synth.rendering.tracer import Traced
from synth.rendering.variant import activate
from synth.sequence import plan_sequence
from synth.silhouette import Grid, exact_outline, level_outline, outline_mesh
from synth.silhouette.noisy_outline import samples_with_normals

RECIPE = Recipe(
    seed=11,
    tier="rendered",
    particle=ParticleRecipe(size_mm=(4.0, 4.5)),
    motion=MotionRecipe(frames=3, speed_ms=(1.5, 2.0), out_of_plane_ms=(0.5, 0.6)),
    hsv=HsvRecipe(width_px=160, height_px=144, exposure_us=60.0, f_number=64.0),
    rig=RigRecipe(drops=1, width_px=96, height_px=72, mm_per_px=0.1, focal_px=(13000.0, 15000.0)),
    rendering=RenderingRecipe(variant="scalar_rgb", rig_samples=144, samples_per_subframe=25),
)
LAST = 2


def planned(*effects: EffectRecipe, **changes: object) -> tuple[SequencePlan, Recipe]:
    recipe = replace(RECIPE, effects=effects, **changes)
    return plan_sequence(recipe, 0), recipe


def last_frame(plan: SequencePlan, recipe: Recipe) -> tuple[Shot, Traced]:
    shot = list(frame_shots(plan, recipe, 0))[LAST]
    tracer, optics = Studio(activate("scalar_rgb"), plan, recipe).camera("hsv")
    return shot, take(tracer, optics, shot, plan.effects)


def edge(shot: Shot, coverage: np.ndarray) -> np.ndarray:
    return level_outline(coverage, Grid(np.array([shot.window.x0, shot.window.y0]) - 0.5, 1, coverage.shape), 0.5)


def outside(outline: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far ``outline`` lies outside ``reference`` (negative: inside) at points along it, and their normals."""
    points, normals = samples_with_normals(reference, spacing_px=1.0, phase=0.0)
    distance = shapely.distance(shapely.points(points), shapely.linearrings(outline))
    return np.where(shapely.contains_xy(shapely.Polygon(outline), *points.T), distance, -distance), normals


def amplitude(off: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Growth and shift (3,) px that fit displacements along normals."""
    return np.linalg.lstsq(np.column_stack([np.ones(len(off)), normals]), off, rcond=None)[0]


EFFECTS = [
    EffectRecipe("frame_rate", {"relative": 0.04}),
    EffectRecipe("length_scale", {"relative": 0.03}),
    EffectRecipe("uniform_acceleration", {"a_x": -400.0}),
    EffectRecipe("radial_distortion", {"k1": 80.0}),
    EffectRecipe("principal_point", {"dx": 1.5, "dy": -0.7}),
    EffectRecipe("pixel_aspect", {"relative": 0.02}),
    EffectRecipe("focal_length", {"relative": 0.03}),
    EffectRecipe("camera_vibration", {"sine_x": 2.0, "cosine_y": 1.0, "frequency": 430.0}),
    EffectRecipe("thermal_focus_drift", {"relative": 0.06, "time_constant": 5e-4}),
    EffectRecipe("rolling_shutter", {"line_time": 2e-6}),
    EffectRecipe("outline_offset", {"offset": 0.7}),
    EffectRecipe("blooming", {"loss": 0.8}),
    EffectRecipe("rim_light_leak", {"loss": 1.2}),
]


@pytest.fixture(scope="module", name="plain")
def plain_outline() -> np.ndarray:
    plan, _ = planned()
    return list(frame_outlines(plan, outline_mesh(plan.vertices, plan.faces)))[LAST]


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.key)
def test_edges_lie_where_the_silhouette_tier_has_them(effect: EffectRecipe, plain: np.ndarray) -> None:
    plan, recipe = planned(effect)
    expected = list(frame_outlines(plan, outline_mesh(plan.vertices, plan.faces)))[LAST]
    shot, traced = last_frame(plan, recipe)
    off, normals = outside(edge(shot, traced.coverage), expected)
    moved, _ = outside(plain, expected)
    assert np.abs(moved).max() > 0.25
    np.testing.assert_allclose(amplitude(off, normals), 0, atol=0.06)
    assert off.std() < 0.15


def test_defocus_widens_edges(plain: np.ndarray) -> None:
    """The variance of the blur adds to that of the edge's profile; measured as the area between two levels."""
    widths = []
    for effects in ((), (EffectRecipe("defocus_growth", {"blur": 3000.0}),)):
        plan, recipe = planned(*effects)
        shot, traced = last_frame(plan, recipe)
        grid = Grid(np.array([shot.window.x0, shot.window.y0]) - 0.5, 1, traced.coverage.shape)
        areas = [shapely.Polygon(level_outline(traced.coverage, grid, level)).area for level in (0.25, 0.75)]
        widths.append((areas[0] - areas[1]) / shapely.Polygon(plain).length)
    sigma = 3000.0 * abs(plan.motion.x_world[LAST, 2] - plan.motion.x_world[0, 2])
    assert sigma > 0.5
    # A Gaussian edge takes 1.349 standard deviations from one quarter to three quarters.
    assert widths[1] ** 2 - widths[0] ** 2 == pytest.approx((1.349 * sigma) ** 2, rel=0.3)


@pytest.mark.parametrize("bias", [0.25, -0.25])
def test_a_bent_response_moves_the_half_level_to_the_biased_one(bias: float) -> None:
    """The half level of the recorded light is the curve on which coverage is ``0.5 - bias``, but for what pixels leave of the profile."""
    plan, recipe = planned(EffectRecipe("motion_blur_threshold", {"bias": bias}))
    shot, traced = last_frame(plan, recipe)
    optics = hsv_optics(plan, recipe)
    background = background_light(optics)
    light = toned(compose(optics, background, shot.window, traced), background, plan.effects, optics)
    recorded = edge(shot, 1 - (light / background)[shot.window.slices])
    grid = Grid(np.array([shot.window.x0, shot.window.y0]) - 0.5, 1, traced.coverage.shape)
    half = level_outline(traced.coverage, grid, 0.5)
    off, expected = outside(recorded, half)[0].mean(), outside(level_outline(traced.coverage, grid, 0.5 - bias), half)[0].mean()
    assert abs(expected) > 0.2
    assert off / expected == pytest.approx(1, abs=0.5)
    ramp = np.array([[0.5 + bias, 1.0, 0.0]])
    np.testing.assert_allclose(toned(3 * ramp, np.full((1, 3), 3.0), plan.effects, optics), [[1.5, 3.0, 0.0]])


def test_a_front_light_has_no_level_of_darkness() -> None:
    effect = EffectRecipe("motion_blur_threshold", {"bias": 0.2})
    plan, recipe = planned(effect, hsv=replace(RECIPE.hsv, light="front"))
    optics = hsv_optics(plan, recipe)
    with pytest.raises(InputError, match=r"expected hsv\.light"):
        toned(np.ones((2, 2)), np.ones((2, 2)), plan.effects, optics)


@pytest.mark.parametrize("effect", [EffectRecipe("length_scale", {"relative": 0.05}), EffectRecipe("view_outline_offset", {"offset": 0.6})])
def test_views_show_the_stated_body_as_their_segmentation_draws_it(effect: EffectRecipe) -> None:
    plan, recipe = planned(effect)
    shot = next(view_shots(plan, recipe, 0))
    tracer, optics = Studio(activate("scalar_rgb"), plan, recipe).camera("rig0")
    view = plan.views[0]
    stated = exact_outline(outline_mesh(plan.view_vertices, plan.faces), view.intrinsics, view.R_cam_particle, view.t_cam_particle)
    traced = take(tracer, optics, shot, plan.effects)
    off, normals = outside(edge(shot, traced.coverage), plan.effects.view_segmented(stated, view.intrinsics))
    np.testing.assert_allclose(amplitude(off, normals), 0, atol=0.06)


def test_sequences_of_one_particle_share_their_pictures_of_it() -> None:
    recipe = replace(RECIPE, sequences=2, same_particle=True)
    first, second = (list(view_shots(plan_sequence(recipe, index), recipe, index)) for index in range(2))
    assert [shot.seeds for shot in first] == [shot.seeds for shot in second]
    assert [shot.window for shot in first] == [shot.window for shot in second]
    words = [picture_stream(recipe, index, what, 0, 1).generate_state(1)[0] for what in ("view background", "frame") for index in range(2)]
    assert words[0] == words[1]
    assert words[2] != words[3]
