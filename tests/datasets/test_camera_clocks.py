"""Each camera may have a clock of its own: written and read back, and refused with the place where it cannot be true."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.observation_files import read_observation, write_observation
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.clock import Clock


@pytest.fixture
def two_cameras(outline_observation: Observation) -> Observation:
    """A second camera of four frames, half a frame later, whose clock is known to 20 µs."""
    first = outline_observation
    R = Rotation.from_rotvec([0.0, np.pi / 2, 0.0]).as_matrix()
    second = HsvCamera("side", first.cameras[0].intrinsics, R, np.array([0.0, 0.0, 0.5]))
    clock = Clock(first.clock.times_s[:4] + 125e-6, 40e-6, offset_sigma_s=20e-6, rate_sigma=1e-5)
    return replace(
        first,
        cameras=(*first.cameras, second),
        recordings=(*first.recordings, first.recordings[0][:4]),
        camera_clocks=(first.clock, clock),
    )


def changed(observation: Observation, **values: object) -> Observation:
    """The observation with another clock of its second camera."""
    return replace(observation, camera_clocks=(observation.clock, replace(observation.clock_of(1), **values)))  # type: ignore[arg-type]


def test_every_camera_has_its_own_times(two_cameras: Observation, tmp_path: Path) -> None:
    write_observation(two_cameras, tmp_path / "o")
    read = read_observation(tmp_path / "o")
    assert [len(recording) for recording in read.recordings] == [5, 4]
    assert [clock.known for clock in read.clocks] == [True, False]
    for got, wanted in zip(read.clocks, two_cameras.clocks, strict=True):
        assert np.array_equal(got.times_s, wanted.times_s)
        assert (got.exposure_s, got.offset_sigma_s, got.rate_sigma) == (wanted.exposure_s, wanted.offset_sigma_s, wanted.rate_sigma)


def test_cameras_of_one_clock_are_written_as_ever(two_cameras: Observation, tmp_path: Path) -> None:
    both = replace(two_cameras, recordings=(two_cameras.recordings[0],) * 2, camera_clocks=())
    write_observation(both, tmp_path / "o")
    assert all("clock" not in camera for camera in json.loads((tmp_path / "o" / "observation.json").read_text())["cameras"])
    assert read_observation(tmp_path / "o").clock_of(1).times_s.tolist() == both.clock.times_s.tolist()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"times_s": np.array([0.0, 2.0, 1.0, 3.0]) * 1e-4}, r"\$\.cameras\[1\]\.clock\.times_s\[2\]: expected times that rise"),
        ({"times_s": 1.0 + np.arange(4) / 4000.0}, 'recorded at the same time, got "side" from 1 to .* clocks do not overlap'),
        ({"times_s": np.arange(4.0) * 2.0, "offset_sigma_s": 0.0}, r"\$\.cameras\[1\]\.clock\.times_s: expected seconds between pictures"),
        ({"exposure_s": 3e-4}, r"\$\.cameras\[1\]\.clock\.exposure_s: expected at most the time between two frames"),
        ({"offset_sigma_s": 1.0}, r"\$\.cameras\[1\]\.clock\.offset_sigma_s: expected at most the time that the recording lasts"),
        ({"rate_sigma": 0.5}, r"\$\.cameras\[1\]\.clock\.rate_sigma: expected at most 0.1"),
        ({"times_s": np.arange(5) / 4000.0}, 'camera "side": expected 5 recorded entries, got 4'),
    ],
)
def test_what_no_clock_can_be(two_cameras: Observation, tmp_path: Path, values: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        write_observation(changed(two_cameras, **values), tmp_path / "o")


def test_stamps_that_may_be_far_off_need_not_overlap(two_cameras: Observation, tmp_path: Path) -> None:
    later = changed(two_cameras, times_s=two_cameras.clock_of(1).times_s + 1.5e-3, offset_sigma_s=7e-4)
    write_observation(later, tmp_path / "o")
    assert read_observation(tmp_path / "o").clock_of(1).offset_sigma_s == 7e-4


def test_the_first_camera_goes_by_the_clock_of_the_observation(two_cameras: Observation, tmp_path: Path) -> None:
    write_observation(two_cameras, tmp_path / "o")
    path = tmp_path / "o" / "observation.json"
    document = json.loads(path.read_text())
    document["cameras"][0]["clock"] = document["cameras"][1]["clock"]
    del document["sha256"]
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"\$\.cameras\[0\]\.clock: expected none"):
        read_observation(tmp_path / "o")
