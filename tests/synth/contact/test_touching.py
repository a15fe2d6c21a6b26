"""When a body comes down on a plate, and that it never does."""

import numpy as np
import pytest

from synth.contact.touching import first_touch
from synth.motion import FreeFlight, fly
from tests.synth.contact.bodies import FLAT, NO_GRAVITY, ball, dropped

RADIUS_M = 2e-3
BALL = ball(RADIUS_M, 1e-4)


def flight(speed_ms: float) -> FreeFlight:
    start = dropped((0.0, 0.0, speed_ms), height_m=0.02)
    return fly(start, BALL.inertia_kgm2, NO_GRAVITY, earliest_s=0.0, latest_s=0.1)


def test_it_touches_when_its_lowest_point_is_down() -> None:
    found = first_touch(flight(-0.5), BALL, FLAT, from_s=0.0, to_s=0.1)
    assert found == pytest.approx((0.02 - RADIUS_M) / 0.5, abs=1e-12)


@pytest.mark.parametrize("speed_ms", [0.5, 0.0, -0.15], ids=["flies away", "rests above", "is not there in time"])
def test_a_body_that_stays_above_never_does(speed_ms: float) -> None:
    assert first_touch(flight(speed_ms), BALL, FLAT, from_s=0.0, to_s=0.1) is None
    assert np.isfinite(flight(speed_ms).at(np.array([0.1])).x_world).all()
