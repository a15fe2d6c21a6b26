"""A body in flight for tests of effects."""

from collections.abc import Callable

import numpy as np
import pytest

from datasets.recipes.effects import values_in_sequence
from datasets.recipes.recipe import EffectRecipe
from datasets.vocabulary.body import Body
from synth.effects import EffectsInForce, FlyingBody
from synth.motion import PushedFlight, Start, fly_pushed

MOMENTS = np.array([2e-9, 3e-9, 4e-9])
START = Start(np.array([0.01, -0.02, 0.6]), np.array([0.5, 0.5, 0.5, 0.5]), np.array([1.0, -0.5, 0.3]), np.array([50.0, 120.0, -80.0]))
SPAN = (-1e-3, 0.03)


def flying_body(moments: np.ndarray = MOMENTS) -> FlyingBody:
    """Half a gram of 4 mm, its axes those of the particle frame."""
    vertices = 2e-3 * np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], dtype=float)
    return FlyingBody(vertices, Body(np.array([1e-4, 0.0, 0.0]), np.eye(3), moments / moments.max()), 5e-4, moments)


@pytest.fixture(name="body")
def body_in_flight() -> FlyingBody:
    return flying_body()


@pytest.fixture(name="start")
def start_of_flight() -> Start:
    return START


@pytest.fixture(name="in_force")
def effects_from_values() -> Callable[..., EffectsInForce]:
    """One effect by key and values; what is left out is 0."""
    return lambda key, **values: EffectsInForce({key: values_in_sequence(EffectRecipe(key, values), 0)})


@pytest.fixture(name="flown")
def flights(in_force: Callable[..., EffectsInForce]) -> Callable[..., PushedFlight]:
    """The flight of the body with one effect, without gravity unless given."""

    def make(key: str, *, gravity: np.ndarray | None = None, moments: np.ndarray = MOMENTS, **values: float) -> PushedFlight:
        g = np.zeros(3) if gravity is None else gravity
        return fly_pushed(START, flying_body(moments), g, in_force(key, **values), span_s=SPAN)

    return make
