"""Times that cannot be seconds."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.observation_files import read_observation, write_observation
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline
from tests.datasets.conftest import square_outline


@pytest.fixture
def fall(outline_observation) -> Observation:
    """20 pictures at 4 kHz of a particle of 5 mm that moves at 1 m/s."""
    views = tuple(replace(view, intrinsics=replace(view.intrinsics, fx_px=6000.0, fy_px=6000.0)) for view in outline_observation.views)
    return replace(
        outline_observation,
        recordings=(tuple(square_outline(20 + 0.4 * k, 20) for k in range(20)),),
        clock=Clock(np.arange(20) / 4000.0, 0.0),
        views=views,
    )


def at(obs: Observation, factor: float) -> Observation:
    return replace(obs, clock=Clock(obs.clock.times_s * factor, 0.0))


def test_seconds_are_taken(fall, tmp_path):
    write_observation(fall, tmp_path / "o")
    assert len(read_observation(tmp_path / "o").clock.times_s) == 20


@pytest.mark.parametrize(
    ("factor", "message"),
    [
        (1e-3, r"\$\.clock\.times_s: expected seconds, got times in which the outlines move at 920 m/s \(at most 150\)"),
        (1e3, r"\$\.clock\.times_s: expected seconds, got 4\.75 between the first and the last outline: a particle falls 111 m"),
        (1e6, r"\$\.clock\.times_s: expected seconds between pictures below 1, got 250; are they ms or us\?"),
    ],
)
def test_other_units_are_refused(fall, tmp_path, factor, message):
    with pytest.raises(InputError, match=message):
        write_observation(at(fall, factor), tmp_path / "o")


def test_pictures_are_judged_by_the_time_between_them(frame_observation, tmp_path):
    with pytest.raises(InputError, match="expected seconds between pictures below 1, got 250"):
        write_observation(at(frame_observation, 1e6), tmp_path / "o")


def test_without_gravity_nothing_falls(fall, tmp_path):
    write_observation(at(replace(fall, gravity_world=np.zeros(3)), 1e3), tmp_path / "o")


def test_outlines_that_are_one_point_tell_no_pace(fall, tmp_path):
    points = tuple(Outline(np.full((3, 2), 20.0 + 0.4 * k)) for k in range(20))
    write_observation(replace(fall, recordings=(points,)), tmp_path / "o")
    assert len(read_observation(tmp_path / "o").clock.times_s) == 20
