"""What effects do to outlines as they are seen, sampled, noisy and smoothed, against the tables that the estimator takes it from."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.geometry.outline_bias import bias_curves, outward_directions
from estimator.geometry.outline_shape import BLURS_PX, DEPTHS_PX, Sampling, outline_shape
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


def seen(curve: Array) -> Array:
    """Mean support of the outline as it is seen."""
    bias = bias_curves([curve], NOISE_PX, np.array([samples(curve)]), pairs=PAIRS, rng=np.random.default_rng(1))[0]
    return np.asarray((curve @ U.T).max(axis=0) + bias)


def of_nature(curve: Array, blur_px: float) -> Array:
    grid = grid_around(curve, 5.0 * blur_px + 2.0, 8)
    return level_outline(blurred(mean_coverage([curve], grid), blur_px * grid.cells_per_px), grid, 0.5)


@pytest.mark.parametrize("blur_px", [0.5, 0.85, 1.4, 2.4, 4.0])
def test_what_is_seen_of_a_blurred_spike_is_the_bias_of_the_sharp_one_and_the_table(rings: list[Array], blur_px: float) -> None:
    for ring in rings:
        shape = outline_shape([ring], sampling=Sampling(NOISE_PX, np.array([samples(ring)]), SPACING_PX))
        plain = outline_shape([ring])
        sharp, there = seen(ring), seen(of_nature(ring, blur_px))
        left = [sharp - receding(table.recession[0], blur_px) - there for table in (shape, plain)]
        assert abs(left[0].mean()) < 0.03
        assert np.sqrt(np.mean(left[0] ** 2)) < 0.06
        assert left[1].mean() < -0.1


@pytest.mark.parametrize("offset_px", [-1.4, -0.7, 0.35, 0.7, 1.4, 2.8])
def test_what_is_seen_of_a_moved_outline_is_the_bias_of_the_sharp_one_and_the_table(rings: list[Array], offset_px: float) -> None:
    """A spike drawn too wide is round, and no longer cut."""
    left = []
    for ring in rings:
        shape = outline_shape([ring], sampling=Sampling(NOISE_PX, np.array([samples(ring)]), SPACING_PX))
        plain = outline_shape([ring])
        there = seen(parallel_curve(ring, offset_px))
        tables = [(each.erosion if offset_px < 0.0 else each.dilation)[0] for each in (shape, plain)]
        left.append([seen(ring) + np.sign(offset_px) * receding(table, abs(offset_px), DEPTHS_PX) - there for table in tables])
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
