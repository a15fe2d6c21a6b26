"""The angle at the body between two cameras, and the pairs that it leaves out of a fit."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimator.appearance.flight_errors import errors_of
from estimator.data.fit_task import restricted
from estimator.fitting.viewing_angles import LEAST_SINE_WITH_VIEWS, sines_between, with_clear_angles
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.motion.flight import N_PARAMETERS, poses
from tests.estimator.fitting.test_within_sequence import seen_by_two, spinning


def test_cameras_at_known_angles() -> None:
    """A camera that looks along its third axis at a centre 0.6 m away, carried around it; turns about its own axis change nothing."""
    centre = np.array([1e-3, -2e-3, 5e-3])
    degrees = np.array([0.0, 3.0, 90.0, 177.0, 180.0])
    R = Rotation.from_euler("yz", np.column_stack([degrees, [0.0, 40.0, 80.0, 120.0, 160.0]]), degrees=True).as_matrix()
    at = PoseSet(np.ascontiguousarray(R), np.array([0.0, 0.0, 0.6]) - R @ centre)
    np.testing.assert_allclose(sines_between(at, at, centre)[0], np.abs(np.sin(np.radians(degrees))), atol=1e-12)


def test_only_pairs_on_nearly_one_line_are_left_out() -> None:
    """Cameras' places are found from the poses anew, in world axes, and their angles by the arc cosine."""
    flight = replace(spinning(), omega=np.array([300.0, 500.0, 200.0]))
    task = seen_by_two(flight)
    clear = with_clear_angles(task, flight)
    flown = poses(flight, np.zeros((1, N_PARAMETERS)), task.sightings.times_s)
    expected = np.ones_like(task.weight)
    for i, camera in enumerate(task.sightings.camera):
        c = task.sightings.cameras[camera]
        seen_from = flown.R[i, 0].T @ (-c.R_cam_world.T @ c.t_cam_world - flown.centre[i, 0])
        for k, (R, t) in enumerate(zip(task.views.poses.R, task.views.poses.t, strict=True)):
            place = -R.T @ t
            cosine = seen_from @ place / np.linalg.norm(seen_from) / np.linalg.norm(place)
            degrees = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
            expected[i, k] = not min(degrees, 180.0 - degrees) < np.degrees(np.arcsin(LEAST_SINE_WITH_VIEWS))
    assert 0 < np.count_nonzero(expected == 0.0) < 0.05 * expected.size
    np.testing.assert_array_equal(clear.weight, expected)
    errors = errors_of(clear, flight, flown)
    assert not errors.valid[expected == 0.0].any()
    few = restricted(clear, np.arange(3))
    np.testing.assert_array_equal(few.weight, expected[:3])
