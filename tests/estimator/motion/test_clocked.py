"""Clocks as parameters: none off changes nothing, times are shifted as stated, derivatives are those of the poses, of any motion."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.motion.clocked import CameraClock, ClockedMotion, frames_and_sensitivity, true_times
from estimator.motion.flight import LAYOUT, FlightPoses, Motion, flown, pose_differences, poses_and_sensitivity
from tests.estimator.fitting.test_within_sequence import spinning
from tests.estimator.motion.test_piecewise import bouncing

Array = NDArray[np.float64]
STAMPS_S = np.array([0.0, 0.002, 0.004, 0.001, 0.003, 0.0045, 0.0035])
CAMERA = np.array([0, 0, 0, 1, 1, 1, 2])
SIDE = CameraClock(1, "side", 0.001, 1e-4, 1e-3)
TOP = CameraClock(2, "top", 0.0035, 1e-4, 0.0)
OFF = np.array([5e-5, 2e-4, -3e-5])
MOTIONS = (spinning(), bouncing())


def clocked(motion: Motion, off: Array = OFF) -> ClockedMotion[Motion]:
    return ClockedMotion(motion, (SIDE, TOP), off)


def poses_of(motion: Motion) -> FlightPoses:
    return flown(motion, true_times(motion, CAMERA, STAMPS_S))


def test_parameters_are_named_after_their_camera_and_held_as_stated() -> None:
    layout = clocked(spinning()).layout
    assert layout.labels[LAYOUT.size :] == ("side.clock_offset_s", "side.clock_rate", "top.clock_offset_s")
    assert layout.precision[LAYOUT.size :] == pytest.approx([1e8, 1e6, 1e8])


def test_frames_are_later_by_offset_and_rate() -> None:
    expected = STAMPS_S + np.array([0.0, 0.0, 0.0, 5e-5, 5e-5 + 4e-7, 5e-5 + 7e-7, -3e-5])
    assert true_times(clocked(spinning()), CAMERA, STAMPS_S) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("motion", MOTIONS)
def test_clocks_that_are_right_change_nothing(motion: Motion) -> None:
    got, by_all = frames_and_sensitivity(clocked(motion, np.zeros(3)), CAMERA, STAMPS_S)
    wanted, by_own = poses_and_sensitivity(motion, STAMPS_S)
    assert np.array_equal(got.centre, wanted.centre)
    assert np.array_equal(by_all[:, :, : motion.layout.size], by_own)


@pytest.mark.parametrize("motion", MOTIONS)
def test_derivatives_are_those_of_the_poses(motion: Motion) -> None:
    at, own = clocked(motion), motion.layout.size
    by_all = frames_and_sensitivity(at, CAMERA, STAMPS_S)[1]
    for column, step in zip(range(own, own + 3), (1e-7, 1e-4, 1e-7), strict=True):
        move = step * np.eye(own + 3)[column]
        every = [poses_of(at), poses_of(at.moved(move)), poses_of(at.moved(-move))]
        joined = FlightPoses(np.concatenate([e.centre for e in every], axis=1), np.concatenate([e.R for e in every], axis=1))
        numeric = pose_differences(joined, np.array([2.0 * step]))[:, :, 0]
        assert by_all[:, :, column] == pytest.approx(numeric, rel=1e-5, abs=1e-5 * np.abs(numeric).max())


def test_frames_of_the_first_camera_do_not_move() -> None:
    by_all = frames_and_sensitivity(clocked(spinning()), CAMERA, STAMPS_S)[1]
    assert not by_all[CAMERA == 0][:, :, LAYOUT.size :].any()


def test_a_step_moves_motion_and_clocks() -> None:
    at = clocked(spinning())
    step = np.zeros(at.layout.size)
    step[0], step[-1] = 1e-3, 1e-5
    moved = at.moved(step)
    assert moved.values - at.values == pytest.approx(step, abs=1e-12)
    assert moved.with_first(replace(moved.first, offset_px=0.1)).values[LAYOUT.size - 1] == 0.1
