"""Outlines that are drawn beside the silhouette."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from datasets.recipes.recipe import EffectRecipe, MotionRecipe, Recipe, RigRecipe
from datasets.vocabulary.camera import Intrinsics
from synth.effects.displacement import parallel_curve
from synth.sequence import build_silhouette_sequence

CAMERA = Intrinsics(1024, 1024, 6000.0, 6000.0, 511.5, 511.5)
ANGLE = np.linspace(0, 2 * np.pi, 720, endpoint=False)
CIRCLE = np.column_stack([np.cos(ANGLE), np.sin(ANGLE)])
HEXAGON = 20.0 * CIRCLE[::120] + 300.0


def area(outline: np.ndarray) -> float:
    return float(shapely.Polygon(outline).area)


@pytest.mark.parametrize("distance", [0.3, 2.0])
def test_parallel_curves_obey_steiner(distance: float) -> None:
    """A convex outline of area A and length P grows to ``A + P d + pi d²``; shrinking by the same gives it back."""
    grown = parallel_curve(HEXAGON, distance)
    length = float(shapely.Polygon(HEXAGON).length)
    assert area(grown) == pytest.approx(area(HEXAGON) + length * distance + np.pi * distance**2, rel=1e-5)
    assert shapely.hausdorff_distance(shapely.linearrings(parallel_curve(grown, -distance)), shapely.linearrings(HEXAGON)) < 2e-3 * distance


def test_nothing_is_left_of_a_thin_outline() -> None:
    with pytest.raises(ValueError, match="nothing is left"):
        parallel_curve(HEXAGON, -20.0)


def test_outline_offset_is_outwards(in_force) -> None:
    drawn = in_force("outline_offset", offset=0.5).segmented(30 * CIRCLE + 300, CAMERA)
    np.testing.assert_allclose(np.linalg.norm(drawn - 300, axis=1), 30.5, atol=2e-3)


def test_blooming_is_strongest_in_the_middle(in_force) -> None:
    effect = in_force("blooming", loss=1.0)
    for centre in (511.5, 100.0):
        drawn = effect.segmented(30 * CIRCLE + centre, CAMERA)
        share = 1 - ((drawn - 511.5) ** 2).sum(axis=1) / (2 * 512.0**2)
        np.testing.assert_allclose(30 - np.linalg.norm(drawn - centre, axis=1), share, atol=3e-3)


def test_light_leaks_through_facets_seen_edge_on(in_force) -> None:
    effect = in_force("rim_light_leak", loss=1.0)
    round_one = effect.segmented(30 * CIRCLE + 300, CAMERA)
    np.testing.assert_allclose(np.linalg.norm(round_one - 300, axis=1), 29.5, atol=0.02)
    half_disk = np.vstack([30 * CIRCLE[:361], [[-30.0, 0.0], [30.0, 0.0]]]) + 300
    drawn = effect.segmented(half_disk, CAMERA)
    flat = drawn[(np.abs(drawn[:, 0] - 300) < 20) & (drawn[:, 1] < 305)]
    bent = drawn[(np.abs(drawn[:, 0] - 300) < 10) & (drawn[:, 1] > 320)]
    mean_radius = (60 + 30 * np.pi) / (2 * np.pi)
    f_flat, f_bent = 60 / (0.349 * mean_radius), 30 / mean_radius
    np.testing.assert_allclose(flat[:, 1] - 300, f_flat / (1 + f_flat), atol=0.02)
    np.testing.assert_allclose(30 - np.linalg.norm(bent - 300, axis=1), f_bent / (1 + f_bent), atol=0.03)


def test_only_views_are_displaced() -> None:
    recipe = Recipe(seed=3, motion=MotionRecipe(frames=3), rig=RigRecipe(drops=1))
    plain, _ = build_silhouette_sequence(recipe, 0)
    moved, _ = build_silhouette_sequence(replace(recipe, effects=(EffectRecipe("view_outline_offset", {"offset": 1.0}),)), 0)
    for a, b in zip(plain.recordings[0], moved.recordings[0], strict=True):
        np.testing.assert_array_equal(a.points_px, b.points_px)
    for a, b in zip(plain.view_recording, moved.view_recording, strict=True):
        grown, length = area(b.points_px) - area(a.points_px), float(shapely.Polygon(b.points_px).convex_hull.length)
        assert grown == pytest.approx(length, rel=0.1)
