"""How surprising a value is that nature or a laboratory does not produce."""

import numpy as np
import pytest

from datasets.vocabulary.effects import Parameter
from estimator.effects.parameter_values import IMPOSSIBLE, surprise

FOCAL = Parameter("relative", "1", (-0.2, 0.2), 1e-4, "a calibration's habit")
DRAG = Parameter("rate", "1/s", (0.0, 5.0), 1e-2, "nothing below zero")


@pytest.mark.parametrize("interval", [(-0.1, 0.1), (0.15, 0.4), (-0.9, -0.2)])
def test_what_reaches_into_the_range_is_no_surprise(interval: tuple[float, float]) -> None:
    assert surprise(interval, FOCAL) == 0.0


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_beyond_a_habit_surprise_grows_slowly(sign: float) -> None:
    found = [surprise(tuple(sorted((sign * k * 0.2, sign * (k * 0.2 + 0.1)))), FOCAL) for k in (1.001, 3.0, 10.0)]
    np.testing.assert_allclose(found, [2.0 * np.log((1 + k**2) / 2) for k in (1.001, 3.0, 10.0)], atol=1e-9)
    assert found[-1] < IMPOSSIBLE


def test_beyond_a_zero_it_is_impossible() -> None:
    assert surprise((-0.4, -0.1), DRAG) == IMPOSSIBLE
    assert 0.0 < surprise((9.0, 11.0), DRAG) < IMPOSSIBLE
