"""The sensor's moments are those of EMVA 1288."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.recipes.recipe import SensorRecipe
from synth.rendering.sensor import Sensor

PLAIN = SensorRecipe(prnu=0.0, dsnu_e=0.0, read_noise_e=10.0)
SHAPE = (200, 300)
SEED = np.random.SeedSequence(5)


def sensor(recipe: SensorRecipe) -> Sensor:
    return Sensor(recipe, SHAPE[1], SHAPE[0], SEED)


def taken(recipe: SensorRecipe, level: float, seed: int = 0) -> np.ndarray:
    return sensor(recipe).read_out(np.full(SHAPE, level), np.random.default_rng(seed)).astype(float)


def test_the_photon_transfer_curve_has_the_slope_of_the_gain() -> None:
    levels = np.array([0.1, 0.3, 0.5, 0.8])
    pictures = [taken(PLAIN, level) for level in levels]
    means, variances = (np.array([f(picture) for picture in pictures]) for f in (np.mean, np.var))
    slope, intercept = np.polyfit(means - PLAIN.dark_offset_dn, variances, 1)
    gain = sensor(PLAIN).gain_dn_per_e
    assert slope == pytest.approx(gain, rel=0.03)
    assert intercept == pytest.approx(gain**2 * PLAIN.read_noise_e**2, abs=0.04 * variances.max())


@pytest.mark.parametrize("level", [0.0, 2e-4, 5e-3])
def test_few_electrons_are_poisson_distributed(level) -> None:
    recipe = replace(PLAIN, read_noise_e=6.0)
    gain, electrons = sensor(recipe).gain_dn_per_e, level * recipe.saturation * recipe.full_well_e
    picture = taken(recipe, level)
    assert picture.mean() == pytest.approx(
        recipe.dark_offset_dn + gain * electrons, abs=5 * gain * np.sqrt((electrons + 36) / picture.size) + 1e-3
    )
    assert picture.var() == pytest.approx(gain**2 * (electrons + 36) + 1 / 12, rel=0.03)


def test_the_fixed_pattern_stays_and_has_its_size() -> None:
    recipe = replace(PLAIN, prnu=0.02, dsnu_e=30.0, read_noise_e=2.0)
    gain = sensor(recipe).gain_dn_per_e
    bright, dark = (np.mean([taken(recipe, level, seed) for seed in range(16)], axis=0) for level in (0.8, 0.0))
    signal = 0.8 * recipe.saturation * recipe.full_well_e * gain
    assert (bright - dark).std() / signal == pytest.approx(0.02, rel=0.05)
    other = Sensor(recipe, SHAPE[1], SHAPE[0], np.random.SeedSequence(6)).read_out(np.full(SHAPE, 0.8), np.random.default_rng(0))
    repeated = taken(recipe, 0.8, 77)
    assert np.corrcoef(repeated.ravel(), bright.ravel())[0, 1] > 0.8
    assert abs(np.corrcoef(other.ravel(), bright.ravel())[0, 1]) < 0.05


def test_the_dark_pattern_has_its_size() -> None:
    recipe = replace(PLAIN, dsnu_e=40.0, read_noise_e=2.0)
    assert taken(recipe, 0.0).std() == pytest.approx(sensor(recipe).gain_dn_per_e * np.hypot(40.0, 2.0), rel=0.02)


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_overexposure_is_full_scale(bits) -> None:
    recipe = replace(PLAIN, bit_depth=bits, dark_offset_dn=8.0)
    assert (taken(recipe, 3.0) == 2**bits - 1).all()
    assert taken(recipe, 1.0).mean() == pytest.approx(8 + 0.8 * (2**bits - 1 - 8), rel=0.002)


def test_an_average_is_quieter_than_one_picture() -> None:
    light = np.full(SHAPE, 0.9)
    one = sensor(PLAIN).read_out(light, np.random.default_rng(1)).astype(float)
    many = sensor(PLAIN).average(light, 16, np.random.default_rng(1)).astype(float)
    assert many.std() == pytest.approx(one.std() / 4, rel=0.05)
    assert many.mean() == pytest.approx(one.mean(), abs=0.3)


def test_read_noise_adds_to_shot_noise_where_both_are_gaussian() -> None:
    recipe = replace(PLAIN, read_noise_e=80.0)
    electrons = 0.05 * recipe.saturation * recipe.full_well_e
    assert taken(recipe, 0.05).var() == pytest.approx(sensor(recipe).gain_dn_per_e ** 2 * (electrons + 6400) + 1 / 12, rel=0.03)
