"""Effects of a tracker, one after the other: derivatives of what it sees by all of their parameters."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimator.effects.empirical.families import VolumeWarp
from estimator.effects.link import EffectModel, Setting
from estimator.effects.model import Model
from estimator.effects.registry import MODELS

Array = NDArray[np.float64]
RNG = np.random.default_rng(17)
PLACES = RNG.normal(0.0, 0.4, (7, 3))
SETTING = Setting(np.arange(7) / 100.0, 1e-4, np.array([0.0, 0.0, -9.81]), np.ones(3), middle_world=np.array([0.1, -0.2, 0.3]), reach_m=0.5)


def by_differences(seen: "partial[Array]", theta: Array) -> Array:
    steps = 1e-6 * np.eye(len(theta))
    return np.stack([(seen(theta + d) - seen(theta - d)) / 2e-6 for d in steps], axis=-1)


def test_what_a_warp_moves_is_second_order_with_a_stretch_and_a_twist() -> None:
    warp, theta = VolumeWarp(), RNG.normal(0.0, 0.02, 22)
    u = (PLACES - SETTING.middle_world) / SETTING.reach_m
    Q = theta[:18].reshape(3, 6)
    second = np.array([Q @ [a * a, b * b, c * c, a * b, a * c, b * c] for a, b, c in u])
    third = [np.sum(each**2) * (theta[18] * each + np.cross(theta[19:], each)) for each in u]
    expected = PLACES + SETTING.reach_m * (second + third)
    np.testing.assert_allclose(warp.tracked(theta, PLACES, SETTING), expected, rtol=1e-13)
    by_default = EffectModel.tracked_by(warp, theta, PLACES, SETTING)
    np.testing.assert_allclose(warp.tracked_by(theta, PLACES, SETTING), by_default, atol=1e-12)


def test_what_comes_later_acts_on_what_came_before() -> None:
    model = Model((MODELS["position_distortion"], MODELS["linear_drag"], VolumeWarp(), MODELS["perspective"]))
    theta = RNG.normal(0.0, 0.03, model.size)
    seen = partial(model.tracked, x=PLACES, setting=SETTING)
    found = model.tracked_by(theta, PLACES, SETTING, 1e-4)
    np.testing.assert_allclose(found, by_differences(seen, theta), atol=1e-7)
    assert not found[:, :, model.slices[1]].any()
