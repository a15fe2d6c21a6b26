"""Films from the side: two coordinates of what flies in a plane, which the camera may see at an angle."""

from functools import cache

import numpy as np
import pytest

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories

TRIED = ("perspective", "position_distortion", "quadratic_drag", "linear_drag", "unmeasured_lift", "uniform_acceleration", "length_scale")
GRAVITY = np.array([0.0, -9.81, 0.0])
RATE_HZ, FROM_M, NOISE_M = 60.0, 2.0, 0.001


def film(
    rng: np.random.Generator, name: str, *, turned_deg: float, drag: float = 0.0, from_m: tuple[float, float] = (0.0, 0.0)
) -> Trajectory:
    """A throw as a camera sees it that stands ``FROM_M`` before the plane, turned about the vertical; lengths by a stick in its middle.

    ``from_m``: where the film has its origin.
    """
    rows = int(rng.integers(24, 48))
    x, v = rng.uniform(-0.4, 0.1, 2), np.array([rng.uniform(1.0, 2.5), rng.uniform(1.0, 3.0)])
    seen = [x]
    for _ in range((rows - 1) * 10):
        half = v + 0.05 / RATE_HZ * (GRAVITY[:2] - drag * np.linalg.norm(v) * v)
        x, v = x + 0.1 / RATE_HZ * half, v + 0.1 / RATE_HZ * (GRAVITY[:2] - drag * np.linalg.norm(half) * half)
        seen.append(x)
    place, turn = np.array(seen[::10]), np.deg2rad(turned_deg)
    depth = FROM_M + place[:, :1] * np.sin(turn)
    picture = FROM_M * place * np.array([np.cos(turn), 1.0]) / depth + rng.normal(0.0, NOISE_M, place.shape)
    x_world = np.column_stack([picture - from_m, np.full(rows, np.nan)])
    where = Surroundings(GRAVITY, Body(np.zeros(3), np.eye(3), np.ones(3)))
    return Trajectory(name, np.arange(rows) / RATE_HZ, x_world, None, None, None, None, None, where)


@cache
def found_in(turned_deg: float, drag: float = 0.0, from_m: tuple[float, float] = (0.0, 0.0)) -> Explanation:
    rng = np.random.default_rng(23)
    registered = register_trajectories([film(rng, f"throw_{i}", turned_deg=turned_deg, drag=drag, from_m=from_m) for i in range(6)])
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})


@pytest.mark.parametrize("turned_deg", [6.0, -9.0])
def test_a_plane_that_is_seen_at_an_angle_is_told_by_its_perspective(turned_deg: float) -> None:
    """Without it in the catalogue: a drag, or a distortion with accelerations and lengths, beside something unknown."""
    found = found_in(turned_deg)
    assert found.found == ("perspective", "length_scale")
    setting, nearer = found.campaign.sequences[0].setting, -np.sin(np.deg2rad(turned_deg)) / FROM_M
    q = found.fit.state.theta[0][found.fit.model.slices[found.fit.model.keys.index("perspective")]]
    assert q[0] == pytest.approx(nearer * setting.reach_m, rel=0.05)
    lengths = found.fit.state.theta[0][found.fit.model.slices[found.fit.model.keys.index("length_scale")]]
    assert lengths[0] == pytest.approx(-nearer * np.asarray(setting.middle_world)[0], abs=0.004)  # the stick lay elsewhere


def test_air_is_no_perspective_and_a_plane_that_is_seen_square_has_none() -> None:
    assert found_in(0.0, 0.3).found == ("quadratic_drag",)
    assert found_in(0.0).found == ()


def test_where_a_film_has_its_origin_does_not_matter() -> None:
    here, there = found_in(6.0), found_in(6.0, 0.0, (-3.0, 2.0))
    assert there.found == here.found
    assert there.campaign.sequences[0].setting.reach_m == pytest.approx(here.campaign.sequences[0].setting.reach_m)
    np.testing.assert_allclose(there.fit.state.theta[0], here.fit.state.theta[0], rtol=1e-3, atol=1e-5)
