"""Exposures that last, and rows that follow one another, against what simple motions make of them."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from datasets.errors import InputError
from datasets.recipes.recipe import EffectRecipe, HsvRecipe, MotionRecipe, Recipe, RigRecipe
from synth.frame_outlines import frame_outlines
from synth.plan import SequencePlan
from synth.sequence import plan_sequence
from synth.silhouette import outline_mesh
from synth.silhouette.noisy_outline import samples_with_normals

GLIDING = Recipe(
    seed=4,
    motion=MotionRecipe(frames=3, speed_ms=(2.0, 2.5), spin_rads=(0.0, 0.0), out_of_plane_ms=(0.0, 0.0), gravity_ms2=(0.0, 0.0, 0.0)),
    hsv=HsvRecipe(exposure_us=100.0),
    rig=RigRecipe(drops=1),
)
"""A flight that is a translation across the picture."""


def outlines(recipe: Recipe, key: str | None = None, **values: float) -> tuple[SequencePlan, list[np.ndarray]]:
    effects = () if key is None else (EffectRecipe(key, values),)
    plan = plan_sequence(replace(recipe, effects=effects), 0)
    return plan, list(frame_outlines(plan, outline_mesh(plan.vertices, plan.faces)))


def displacement(outline: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How far ``outline`` lies outside ``points`` (negative: inside)."""
    distance = shapely.distance(shapely.points(points), shapely.linearrings(outline))
    return np.where(shapely.contains_xy(shapely.Polygon(outline), *points.T), distance, -distance)


def velocity_px(plan: SequencePlan, number: int) -> np.ndarray:
    """Of a gliding particle in the picture, px/s."""
    return 6000.0 * plan.motion.v_world[number, :2] / plan.motion.x_world[number, 2]


def test_blur_at_the_half_level_leaves_the_middle_of_the_exposure_in_place() -> None:
    _, sharp = outlines(GLIDING)
    _, soft = outlines(GLIDING, "motion_blur_threshold", bias=1e-9)
    for a, b in zip(sharp, soft, strict=True):
        points, _ = samples_with_normals(a, spacing_px=0.5, phase=0.25)
        off = displacement(b, points)
        assert abs(np.median(off)) < 2e-3
        assert np.quantile(np.abs(off), 0.9) < 0.02


@pytest.mark.parametrize("bias", [0.2, -0.2])
def test_the_threshold_moves_leading_and_trailing_edges(bias: float) -> None:
    """On stretches without corners ``delta = bias |u . w| T``."""
    plan, sharp = outlines(GLIDING)
    _, drawn = outlines(GLIDING, "motion_blur_threshold", bias=bias)
    points, normals = samples_with_normals(sharp[1], spacing_px=0.5, phase=0.25)
    flat = np.minimum(*(np.abs((normals * np.roll(normals, k, axis=0)).sum(axis=1)) for k in (9, -9))) > 0.9999
    expected = bias * np.abs(normals @ velocity_px(plan, 1)) * plan.clock.exposure_s
    off = displacement(drawn[1], points)
    assert flat.sum() > 30
    assert np.ptp(expected[flat]) > 0.2
    np.testing.assert_allclose(off[flat], expected[flat], atol=5e-3)


def test_there_is_no_outline_beyond_dark_and_bright() -> None:
    with pytest.raises(InputError, match=r"between -0\.5 and 0\.5, got 0\.5"):
        outlines(GLIDING, "motion_blur_threshold", bias=0.5)


@pytest.mark.parametrize("line_time", [2e-7, -2e-7])
def test_rolling_shutter_shears_a_gliding_particle(line_time: float) -> None:
    """A point at (x, y) at the frame's time is seen at ``(x, y) + w d`` with ``d = line_time (y + w_y d - middle)``.

    ``w`` is the centre's; nearer and farther points move faster and slower by up to 0.5%, of shifts of up to 2 px.
    """
    plan, still = outlines(GLIDING)
    _, rolled = outlines(GLIDING, "rolling_shutter", line_time=line_time)
    for number in range(3):
        w = velocity_px(plan, number)
        points, _ = samples_with_normals(still[number], spacing_px=0.5, phase=0.0)
        delay = line_time * (points[:, 1] - 511.5) / (1 - line_time * w[1])
        np.testing.assert_allclose(displacement(rolled[number], points + delay[:, None] * w), 0, atol=0.01)
        assert np.abs(delay[:, None] * w).max() > 0.3


def test_rows_of_a_spinning_particle_are_those_of_their_instants() -> None:
    """The span of every row of the rolled outline is that of the exact outline at this row's instant."""
    recipe = replace(GLIDING, motion=replace(GLIDING.motion, spin_rads=(300.0, 300.0)))
    plan, rolled = outlines(recipe, "rolling_shutter", line_time=3e-7)
    mesh = outline_mesh(plan.vertices, plan.faces)
    polygon = shapely.Polygon(rolled[1])
    low, high = polygon.bounds[1], polygon.bounds[3]
    for y in np.linspace(low + 4, high - 4, 7):
        delay = 3e-7 * (y - 511.5)
        moment = replace(plan, effects=type(plan.effects)(), true_times_s=plan.true_times_s[1:2] + delay)
        moment = replace(moment, motion=plan.flight.at(moment.true_times_s), clock=replace(plan.clock, times_s=plan.clock.times_s[1:2]))
        (instant,) = frame_outlines(moment, mesh)
        line = shapely.linestrings([[-1e4, y], [1e4, y]])
        spans = [shapely.intersection(shapely.Polygon(ring), line).bounds[::2] for ring in (rolled[1], instant)]
        np.testing.assert_allclose(spans[0], spans[1], atol=0.01)
