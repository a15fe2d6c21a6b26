"""Both realisations on a cut stone, whose outline has corners, and on a jagged body, whose outline has spikes and hollows.

What acts through poses, the lens or a constant displacement is as exact as on a smooth body; a displacement that varies along the outline
moves tangents off a corner, and is held to a few per cent, a blur to some ten.
"""

from dataclasses import replace

import pytest

from datasets.recipes.recipe import Recipe
from estimator.effects.registry import MODELS
from tests.agreement.exact_sequences import RECIPE, errors_at, made, rms
from tests.agreement.sizes import SIZES

STONE = replace(RECIPE, particle=replace(RECIPE.particle, family="cut_stone", irregularity=0.5))
EXACT = 1e-3
ALONG_THE_OUTLINE = {
    "blooming": 0.04,
    "rolling_shutter": 0.012,
    "motion_blur_threshold": 0.06,
    "rim_light_leak": 0.02,
    "defocus_growth": 0.13,
}
"""2.1%, 0.8%, 4.6%, 1.3% and 10.6% seen."""


@pytest.mark.parametrize("key", [key for key in SIZES if key != "trigger_jitter"])
def test_the_model_undoes_what_nature_does_to_a_stone(key: str) -> None:
    values, sequence = SIZES[key], made(key, SIZES[key], STONE)
    size = rms(errors_at(sequence, key, dict.fromkeys(values, 0.0)))
    assert size > 0.03
    assert rms(errors_at(sequence, key, values)) <= ALONG_THE_OUTLINE.get(key, EXACT) * size


JAGGED = replace(RECIPE, particle=replace(RECIPE.particle, family="jagged", irregularity=0.5))
AT_SPIKES = {
    "outline_offset": 0.05,
    "blooming": 0.10,
    "rim_light_leak": 0.08,
    "defocus_growth": 0.17,
    "motion_blur_threshold": 0.18,
    "rolling_shutter": 0.012,
    "view_outline_offset": 0.22,
}
"""3.4%, 7.6%, 6.0%, 13.9%, 16.5% and 0.7% seen. Outlines of the calibrated views are moved by a constant: 18.6%."""


@pytest.mark.parametrize("recipe", [STONE, JAGGED], ids=["stone", "jagged"])
@pytest.mark.parametrize("key", sorted({*ALONG_THE_OUTLINE, *AT_SPIKES}))
def test_what_a_model_leaves_is_within_the_accuracy_that_it_claims(key: str, recipe: Recipe) -> None:
    values = {name: -value if key.endswith("outline_offset") else value for name, value in SIZES[key].items()}
    sequence = made(key, values, recipe)
    left = rms(errors_at(sequence, key, values)) / rms(errors_at(sequence, key, dict.fromkeys(values, 0.0)))
    assert left <= 2.0 * MODELS[key].accuracy


@pytest.mark.parametrize("key", AT_SPIKES)
def test_spikes_recede_with_their_own_sides(key: str) -> None:
    values = {name: -value if key.endswith("outline_offset") else value for name, value in SIZES[key].items()}
    sequence = made(key, values, JAGGED)
    size = rms(errors_at(sequence, key, dict.fromkeys(values, 0.0)))
    assert size > 0.2
    assert rms(errors_at(sequence, key, values)) <= AT_SPIKES[key] * size
