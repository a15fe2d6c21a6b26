"""Effects that are put into recordings have the sizes that are said."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from scripts.real.injected_effects import PUT_IN, TOLD_RATE_HZ
from scripts.real.real_tosses import RATE_HZ

T = np.arange(38) / RATE_HZ
V, GRAVITY = np.array([1.2, -0.4, 0.8]), np.array([0.0, 0.0, -9.81])
LEVEL = np.tile([0.0, 0.0, 0.0, 1.0], (len(T), 1))
FALLING = V * T[:, None] + 0.5 * GRAVITY * T[:, None] ** 2


@pytest.mark.parametrize(
    ("name", "force"),
    [
        ("linear_drag", lambda v: -0.3 * v),
        ("quadratic_drag", lambda v: -0.25 * np.linalg.norm(v) * v),
        ("wind", lambda v: -0.2 * (v - np.array([2.0, 0.0, 0.0]))),
        ("acceleration", lambda _: np.array([0.4, 0.0, 0.0])),
    ],
)
def test_a_force_that_is_put_in_moves_as_if_it_had_acted(name: str, force) -> None:  # type: ignore[no-untyped-def]
    """To a part of it as large as it changes the velocity: 0.3 1/s for a quarter of a second, 0.25 1/m at 1.5 m/s."""
    x, _ = PUT_IN[name]((FALLING, LEVEL))
    flown = solve_ivp(lambda _, y: [*y[3:], *(GRAVITY + force(y[3:]))], (0.0, T[-1]), [0.0, 0.0, 0.0, *V], t_eval=T, rtol=1e-10)
    np.testing.assert_allclose(x - FALLING, flown.y[:3].T - FALLING, atol=0.08 * np.abs(x - FALLING).max())
    assert np.abs(x - FALLING).max() > 2e-3


def test_nothing_is_nothing_and_the_others_are_as_large_as_said() -> None:
    assert PUT_IN["nothing"]((FALLING, LEVEL))[0] is FALLING
    assert RATE_HZ / TOLD_RATE_HZ["frame_rate"] == pytest.approx(1.02)
    np.testing.assert_allclose(PUT_IN["length_scale"]((FALLING, LEVEL))[0], 0.95 * FALLING)
    np.testing.assert_allclose(PUT_IN["centre_of_mass"]((FALLING, LEVEL))[0] - FALLING, np.tile([0.008, 0.0, 0.0], (len(T), 1)), atol=1e-12)
    np.testing.assert_allclose(PUT_IN["gravity_tilted"]((FALLING, LEVEL))[0][:, 1], FALLING[:, 1])
