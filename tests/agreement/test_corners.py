"""Both realisations on a cut stone, whose outline has corners.

What acts through poses, the lens or a constant displacement is as exact as on a smooth body; a displacement that varies along the outline
moves tangents off a corner, and is held to a tenth. The two effects that follow the outline's curvature, defocus and light through a
facetted rim, are not compared here: their reduced models know a corner only as a radius of zero, and leave most of what they do at corners.
"""

from dataclasses import replace

import pytest

from tests.agreement.exact_sequences import RECIPE, errors_at, made, rms
from tests.agreement.sizes import SIZES

STONE = replace(RECIPE, particle=replace(RECIPE.particle, family="cut_stone", irregularity=0.5))
EXACT = 1e-3
ALONG_THE_OUTLINE = {"blooming": 0.04, "rolling_shutter": 0.06, "motion_blur_threshold": 0.1}
"""2.1%, 4.4% and 7.2% seen."""
BY_CURVATURE = ("defocus_growth", "rim_light_leak")


@pytest.mark.parametrize("key", [key for key in SIZES if key not in (*BY_CURVATURE, "trigger_jitter")])
def test_the_model_undoes_what_nature_does_to_a_stone(key: str) -> None:
    values, sequence = SIZES[key], made(key, SIZES[key], STONE)
    size = rms(errors_at(sequence, key, dict.fromkeys(values, 0.0)))
    assert size > 0.03
    assert rms(errors_at(sequence, key, values)) <= ALONG_THE_OUTLINE.get(key, EXACT) * size
