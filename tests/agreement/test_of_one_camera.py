"""An effect of one camera of two: nature's and the instrument's are the same, and nothing of it is in the other camera's pictures.

The second camera stands at a right angle, has a lens and an exposure of its own, and its frames are stamped later.
"""

from dataclasses import replace

import numpy as np
import pytest

from datasets.recipes.recipe import FurtherHsvRecipe
from datasets.vocabulary.effects import EFFECTS, of_camera
from estimator.appearance.model_errors import ModelErrors, model_errors
from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.motion.flight import N_PARAMETERS
from tests.agreement.exact_sequences import RECIPE, RECIPES, Array, Made, made, task_of, theta_of, true_flight
from tests.agreement.sizes import SIZES
from tests.agreement.test_both_realisations import EXACT, LEFT_OUT
from tests.agreement.test_derivatives import AGREE, AT_CORNERS, FEWEST

ROUNDING_PX = 1e-8
OTHER_STEPS_PX = 1e-4
"""Flights are integrated from time to time: other times of one camera make other steps."""
NAMES = ("hsv", "hsv_2")
SECOND = FurtherHsvRecipe(focal_mm=60.0, width_px=1000, height_px=900, exposure_us=60.0, delay_frames=0.3)
OF_SECOND = sorted(key for key in SIZES if of_camera(key, NAMES[1]) in catalogue(NAMES))
MOVED = [(key, name) for key in OF_SECOND for name in EFFECTS[key].names if name not in MODELS[key].frozen]


def sequence(key: str) -> Made:
    recipe = RECIPES.get(key, RECIPE)
    return made(key, SIZES[key], replace(recipe, further_hsv=(SECOND,)), camera=1)


def errors(key: str, camera: str | None, theta: Array) -> ModelErrors:
    effect = MODELS[key] if camera is None else MODELS[key].of_camera(camera)
    return model_errors(task_of(sequence(key)), true_flight(sequence(key), 0.0), Model((effect,)), theta)


def by_camera(e: Array, of: ModelErrors) -> list[float]:
    """RMS (px) of what is seen by each camera."""
    number = of.places.seen.number
    return [float(np.sqrt(np.mean(e[number == c][of.seen[number == c]] ** 2))) for c in range(2)]


def test_every_effect_of_a_camera_is_tried() -> None:
    assert {"focal_length", "principal_point", "rolling_shutter", "frame_rate", "clock_offset", "blooming"} <= set(OF_SECOND)
    assert not {"view_outline_offset", "rim_light_leak", "gravity", "trigger_jitter"} & set(OF_SECOND)


@pytest.mark.parametrize("key", OF_SECOND)
def test_the_second_cameras_effect_undoes_what_nature_does_there(key: str) -> None:
    theta = theta_of(key, SIZES[key])
    left, nothing = errors(key, "hsv_2", theta), errors(key, "hsv_2", np.where(MODELS[key].silent(0.0 * theta), theta, 0.0))
    (first, second), (_, size) = by_camera(left.e, left), by_camera(nothing.e, nothing)
    assert size > 0.03
    assert second <= LEFT_OUT.get(key, EXACT) * size
    assert first <= EXACT * size


@pytest.mark.parametrize("key", OF_SECOND)
@pytest.mark.parametrize("number", [0, 1])
def test_an_effect_of_a_camera_is_not_in_the_others_pictures(key: str, number: int) -> None:
    """Neither in the errors nor in their derivatives; in its own pictures it does what one of all cameras does."""
    theta = theta_of(key, SIZES[key])
    alone, alike, none = errors(key, NAMES[number], theta), errors(key, None, theta), errors(key, NAMES[number], 0.0 * theta)
    mine = alone.places.seen.number == number
    np.testing.assert_allclose(alone.e[~mine], none.e[~mine], atol=OTHER_STEPS_PX)
    assert not alone.J[~mine][..., N_PARAMETERS:].any()
    if EFFECTS[key].stage != "clock":  # of a clock stamps count from the camera's own first one
        np.testing.assert_allclose(alone.e[mine], alike.e[mine], atol=OTHER_STEPS_PX)
        size = np.abs(alike.J[mine]).max(axis=(0, 1, 2))
        assert np.all(np.abs(alone.J[mine] - alike.J[mine]) <= 1e-3 * size)
    assert np.abs(alone.e[mine] - none.e[mine]).max() > 1e-3


@pytest.mark.parametrize("key", OF_SECOND)
def test_of_no_size_it_is_the_identity(key: str) -> None:
    effect, at = MODELS[key].of_camera("hsv_2"), sequence(key)
    plain = model_errors(task_of(at), true_flight(at, 0.0), Model(), np.zeros(0))
    sized = np.array([name in effect.entry.sizes for name in effect.entry.names])
    nothing = errors(key, "hsv_2", np.where(sized, 0.0, theta_of(key, SIZES[key])))
    np.testing.assert_allclose(nothing.e, plain.e, atol=ROUNDING_PX)


@pytest.mark.parametrize(("key", "name"), MOVED)
def test_columns_are_the_derivatives(key: str, name: str) -> None:
    entry, theta = EFFECTS[key], theta_of(key, SIZES[key])
    number = entry.names.index(name)
    step = np.zeros(len(theta))
    step[number] = 0.1 * entry.parameters[number].step
    there, high, low = (errors(key, "hsv_2", theta + s * step) for s in (0.0, 1.0, -1.0))
    stays = (
        (high.tangency.tangency == low.tangency.tangency)[:, :, :2] & high.seen & low.seen & there.places.seen.by("hsv_2")[:, None, None]
    )
    assert stays.mean() > 0.5 * FEWEST
    slope, column = (high.e - low.e)[stays] / (2.0 * step[number]), there.J[..., N_PARAMETERS + number][stays]
    size = float(np.sqrt(np.mean(slope**2)))
    assert size > 0.0
    assert np.abs(column - slope).max() <= AT_CORNERS.get(key, AGREE) * size
