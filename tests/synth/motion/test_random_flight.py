"""Random flights stay in the picture and have the distributions that the recipe asks for."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.recipes.recipe import HsvRecipe, MotionRecipe
from synth.high_speed_camera import hsv_camera
from synth.motion import Start, random_start
from synth.motion.random_flight import Stage
from synth.sequence import frame_times

RECIPE = MotionRecipe(speed_ms=(0.0, 3.0))


def stage(recipe: MotionRecipe, hsv: HsvRecipe | None = None) -> Stage:
    hsv = hsv or HsvRecipe()
    return Stage(hsv_camera(hsv).intrinsics, hsv.distance_m, 4e-3, frame_times(recipe))


def starts(recipe: MotionRecipe, count: int, hsv: HsvRecipe | None = None) -> list[Start]:
    rng = np.random.default_rng(11)
    return [random_start(recipe, stage(recipe, hsv), rng) for _ in range(count)]


@pytest.mark.parametrize("distortion", [(0.0,) * 5, (-0.25, 0.1, 1e-3, -1e-3, 0.0)])
def test_the_whole_particle_stays_in_the_picture(distortion: tuple[float, float, float, float, float]) -> None:
    hsv = HsvRecipe(distortion=distortion, principal_point_offset_px=(20.0, -15.0))
    where = stage(RECIPE, hsv)
    rng = np.random.default_rng(2)
    ball = rng.normal(size=(200, 3))
    ball *= where.radius_m / np.linalg.norm(ball, axis=1, keepdims=True)
    for start in starts(RECIPE, 40, hsv):
        t = where.times_s[:, None]
        centres = start.x_world + start.v_world * t + 0.5 * np.array(RECIPE.gravity_ms2) * t**2
        px = where.intrinsics.project((centres[:, None] + ball).reshape(-1, 3))
        assert px.min() >= 0
        assert px[:, 0].max() <= hsv.width_px - 1
        assert px[:, 1].max() <= hsv.height_px - 1


def test_the_middle_frame_lies_in_the_focal_plane() -> None:
    for start in starts(RECIPE, 10):
        assert start.x_world[2] + start.v_world[2] * frame_times(RECIPE)[50] == pytest.approx(0.6)


def test_speed_and_spin_are_uniform_and_directions_isotropic() -> None:
    drawn = starts(RECIPE, 600)
    speeds = np.array([np.linalg.norm(s.v_world) for s in drawn])
    spins = np.array([np.linalg.norm(s.omega_world) for s in drawn])
    axes = np.array([s.omega_world for s in drawn]) / spins[:, None]
    # Four standard errors of a uniform mean over 600 draws: 4 * range / sqrt(12 * 600) = 0.047 * range.
    assert abs(speeds.mean() - 1.5) < 0.047 * 3
    assert abs(spins.mean() - 150) < 0.047 * 300
    # Components of isotropic unit vectors have variance 1/3.
    assert np.abs(axes.mean(axis=0)).max() < 4 * np.sqrt(1 / 3 / 600)


def test_out_of_plane_speed_is_set_apart() -> None:
    recipe = replace(RECIPE, speed_ms=(1.0, 1.5), out_of_plane_ms=(0.2, 0.3))
    drawn = np.array([s.v_world for s in starts(recipe, 60)])
    assert np.all((np.abs(drawn[:, 2]) >= 0.2) & (np.abs(drawn[:, 2]) <= 0.3))
    speed = np.linalg.norm(drawn, axis=1)
    assert np.all((speed >= 1.0) & (speed <= 1.5))
    assert {-1.0, 1.0} == set(np.sign(drawn[:, 2]))


def test_a_flight_along_the_axis() -> None:
    drawn = np.array([s.v_world for s in starts(replace(RECIPE, speed_ms=(1.5, 1.5), out_of_plane_ms=(1.5, 1.5)), 10)])
    np.testing.assert_allclose(np.abs(drawn), [[0, 0, 1.5]] * 10, atol=1e-12)


def test_a_speed_is_never_less_than_its_part_along_the_axis() -> None:
    drawn = np.array([s.v_world for s in starts(replace(RECIPE, speed_ms=(0.0, 1.0), out_of_plane_ms=(0.5, 2.0)), 60)])
    assert np.all((np.abs(drawn[:, 2]) >= 0.5) & (np.linalg.norm(drawn, axis=1) <= 1.0))


def test_a_flight_that_cannot_fit_says_what_to_change() -> None:
    recipe = replace(RECIPE, speed_ms=(30.0, 40.0))
    with pytest.raises(InputError, match=r"lower motion\.speed_ms or motion\.frames"):
        starts(recipe, 1)
