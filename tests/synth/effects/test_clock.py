"""Clocks that are wrong in a known way."""

import numpy as np
import pytest

from datasets.recipes.recipe import EffectRecipe, MotionRecipe, Recipe, RigRecipe
from synth.sequence import plan_sequence, truth_of

STAMPS = np.arange(10) / 4000


def times(in_force, key: str, **values: float) -> np.ndarray:
    return in_force(key, **values).true_times(STAMPS, np.random.default_rng(1))


def test_a_fast_recorder_squeezes_time(in_force) -> None:
    np.testing.assert_allclose(times(in_force, "frame_rate", relative=0.25), np.arange(10) / 5000, atol=1e-15)


def test_frames_after_the_gap_are_late(in_force) -> None:
    late = times(in_force, "dropped_frames", count=2.0, after_frame=3.0) - STAMPS
    np.testing.assert_array_equal(late[:4], 0)
    np.testing.assert_allclose(late[4:], 2 / 4000)


def test_jitter_is_white_and_of_its_size(in_force) -> None:
    many = np.arange(4000) / 4000
    off = in_force("trigger_jitter", sigma=1e-5).true_times(many, np.random.default_rng(2)) - many
    twice = in_force("trigger_jitter", sigma=2e-5).true_times(many, np.random.default_rng(2)) - many
    np.testing.assert_allclose(twice, 2 * off, atol=1e-15)
    assert off.std() == pytest.approx(1e-5, rel=0.05)
    assert abs(np.corrcoef(off[1:], off[:-1])[0, 1]) < 0.05


def test_frames_are_as_even_as_their_stamps_are_to_blame(in_force) -> None:
    stamps = np.round(np.arange(12) / 144.0, 3)
    whole, half = (in_force("stamp_scatter", share=share).true_times(stamps, np.random.default_rng(1)) for share in (1.0, 0.5))
    np.testing.assert_allclose(np.diff(whole), np.diff(whole).mean(), rtol=1e-9)
    np.testing.assert_allclose(half, 0.5 * (whole + stamps))
    assert whole.mean() == pytest.approx(stamps.mean())


@pytest.mark.parametrize("effect", [EffectRecipe("frame_rate", {"relative": 0.03}), EffectRecipe("trigger_jitter", {"sigma": 1e-5})])
def test_a_sequence_is_taken_at_true_times_and_stamped_with_nominal_ones(effect: EffectRecipe) -> None:
    recipe = Recipe(seed=3, motion=MotionRecipe(frames=6, speed_ms=(1.0, 2.0)), rig=RigRecipe(drops=1))
    plain, plan = plan_sequence(recipe, 0), plan_sequence(Recipe(**{**vars(recipe), "effects": (effect,)}), 0)
    np.testing.assert_array_equal(plan.clock.times_s, plain.clock.times_s)
    np.testing.assert_array_equal(plan.motion.times_s, plain.clock.times_s)
    assert not np.array_equal(plan.true_times_s, plain.true_times_s)
    inside = (plan.true_times_s >= plain.flight.rotation.earliest_s) & (plan.true_times_s <= plain.flight.rotation.latest_s)
    np.testing.assert_allclose(plan.motion.x_world[inside], plain.flight.at(plan.true_times_s[inside]).x_world, atol=1e-13)
    assert truth_of(plan).notes["true_times_s"] == plan.true_times_s.tolist()
    assert "true_times_s" not in truth_of(plain).notes
