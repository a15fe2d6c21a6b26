"""What effects do to outlines as they are seen, sampled, noisy and smoothed, against the tables that the estimator takes it from."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.geometry.outline_bias import bias_curves, outward_directions
from estimator.geometry.outline_shape import ANGLES, BLURS_PX, DEPTHS_PX, OutlineShape, Sampling, outline_shape
from synth.effects.displacement import parallel_curve
from synth.frame_outlines import frame_outlines
from synth.sequence import plan_sequence
from synth.silhouette import blurred, grid_around, level_outline, mean_coverage, outline_mesh
from tests.agreement.exact_sequences import RECIPE

Array = NDArray[np.float64]
NOISE_PX, SPACING_PX, PAIRS = 0.2, 1.0, 32
JAGGED = replace(RECIPE, particle=replace(RECIPE.particle, family="jagged", irregularity=0.6))
U = outward_directions()


@pytest.fixture(scope="module")
def rings() -> list[Array]:
    """Sharp outlines of a body with spikes."""
    plan = plan_sequence(JAGGED, 0)
    return list(frame_outlines(plan, outline_mesh(plan.vertices, plan.faces)))[::3]


def samples(curve: Array) -> int:
    return round(float(np.linalg.norm(np.roll(curve, -1, axis=0) - curve, axis=1).sum()) / SPACING_PX)


def seen(curve: Array, count: int) -> Array:
    """Mean support of the outline as it is seen with ``count`` samples."""
    bias = bias_curves([curve], NOISE_PX, np.array([count]), pairs=PAIRS, rng=np.random.default_rng(1))[0]
    return np.asarray((curve @ U.T).max(axis=0) + bias)


def tables(curve: Array, count: int) -> tuple[OutlineShape, OutlineShape]:
    """Of the outline as it is seen, and as it is."""
    return outline_shape([curve], sampling=Sampling(NOISE_PX, np.array([count]))), outline_shape([curve])


def of_nature(curve: Array, blur_px: float) -> Array:
    grid = grid_around(curve, 5.0 * blur_px + 2.0, 8)
    return level_outline(blurred(mean_coverage([curve], grid), blur_px * grid.cells_per_px), grid, 0.5)


@pytest.mark.parametrize("blur_px", [0.5, 0.85, 1.4, 2.4, 4.0])
def test_what_is_seen_of_a_blurred_spike_is_the_bias_of_the_sharp_one_and_the_table(rings: list[Array], blur_px: float) -> None:
    for ring in rings:
        there = of_nature(ring, blur_px)
        count = samples(there)
        shape, plain = tables(ring, count)
        sharp, there = seen(ring, count), seen(there, count)
        left = [sharp - receding(table.recession[0], blur_px) - there for table in (shape, plain)]
        assert abs(left[0].mean()) < 0.03
        assert np.sqrt(np.mean(left[0] ** 2)) < 0.06
        assert left[1].mean() < -0.1


@pytest.mark.parametrize("offset_px", [-1.4, -0.7, 0.35, 0.7, 1.4, 2.8])
def test_what_is_seen_of_a_moved_outline_is_the_bias_of_the_sharp_one_and_the_table(rings: list[Array], offset_px: float) -> None:
    """A spike drawn too wide is round, and no longer cut."""
    left = []
    for ring in rings:
        there = parallel_curve(ring, offset_px)
        count = samples(there)
        moved = [(each.erosion if offset_px < 0.0 else each.dilation)[0] for each in tables(ring, count)]
        sharp, there = seen(ring, count), seen(there, count)
        left.append([sharp + np.sign(offset_px) * receding(table, abs(offset_px), DEPTHS_PX) - there for table in moved])
    as_seen, as_it_is = np.moveaxis(np.array(left), 1, 0)
    assert abs(as_seen.mean()) < 0.02
    assert np.sqrt(np.mean(as_seen**2)) < 0.05
    assert np.sqrt(np.mean(as_seen**2)) < 0.75 * np.sqrt(np.mean(as_it_is**2))


def receding(table: Array, at_px: float, knots_px: Array = BLURS_PX) -> Array:
    """What the tangents along ``U`` recede (px), interpolated as the models do."""
    place = float(np.interp(at_px, knots_px, np.arange(len(knots_px))))
    at = np.array([np.interp(place, np.arange(len(knots_px)), row) for row in table])
    angle = np.linspace(0.0, 2.0 * np.pi, len(at) + 1)
    return np.asarray(at_px * np.interp(np.linspace(0.0, 2.0 * np.pi, len(U), endpoint=False), angle, np.append(at, at[0])))


@pytest.mark.parametrize("dense", [0.8, 1.0, 1.25])
def test_a_small_blur_of_a_smooth_outline_is_told_from_noise_and_from_the_number_of_its_samples(dense: float) -> None:
    """``s² / (2 rho)`` along an ellipse, whatever the draws of noise and however dense the samples."""
    angle = 2.0 * np.pi * np.arange(720) / 720
    ellipse = np.column_stack([20.0 * np.cos(angle), 15.0 * np.sin(angle)])
    shape = outline_shape([ellipse], sampling=Sampling(NOISE_PX, np.array([round(dense * samples(ellipse))])))
    towards = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    reach = np.hypot(20.0 * np.cos(towards), 15.0 * np.sin(towards))
    radius_px = (20.0 * 15.0) ** 2 / reach**3
    for number, blur_px in enumerate(BLURS_PX[BLURS_PX <= 2.0]):
        left = blur_px * shape.recession[0, :, number] - blur_px**2 / (2.0 * radius_px)
        assert abs(left.mean()) < 0.005
        assert left.std() < 0.02
