"""Poses in the frames of a further camera, whose frames were taken at other times than those at which an estimate states the motion.

An estimate states poses and velocities at the first camera's frames. In a frame of another camera the body is where it flies from the
nearest of them within the time between, freely.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate
from datasets.observation import Observation
from datasets.vocabulary.state import Motion
from estimator.motion.rigid_body import States, angular_momentum, fall, inverted

Array = NDArray[np.float64]


def frame_times(estimate: Estimate, observation: Observation, camera: int) -> Array:
    """Times (frame,) s of a camera's frames by the first camera's clock, with what the estimate found of its own."""
    stamps = observation.clock_of(camera).times_s
    found = estimate.statistics.get("clocks", {}).get(observation.cameras[camera].name, {})
    return np.asarray(stamps + found.get("offset_s", 0.0) + found.get("rate", 0.0) * (stamps - stamps[0]))


def motion_in_frames(motion: Motion, estimate: Estimate, observation: Observation, camera: int) -> Motion:
    """The estimated ``motion`` at the frames of a camera, by the first camera's clock."""
    times = frame_times(estimate, observation, camera)
    if np.array_equal(times, motion.times_s):
        return motion
    nearest = np.argmin(np.abs(times[:, None] - motion.times_s), axis=1)
    parts = [_flown(motion, estimate, observation.gravity_world, int(row), time_s) for row, time_s in zip(nearest, times, strict=True)]
    x, q, v = (np.stack([getattr(part, name)[0, 0] for part in parts]) for name in ("x", "q", "v"))
    return Motion(times, x, q, v, motion.omega_world[nearest])


def _flown(motion: Motion, estimate: Estimate, gravity_world: Array, row: int, time_s: float) -> States:
    """The body at a time, from where it is in a row of its motion."""
    assert estimate.body is not None
    inertia = np.diag(estimate.body.inertia_ratios)[None]
    x, q, v, omega = (each[[row]] for each in (motion.x_world, motion.q_world_body, motion.v_world, motion.omega_world))
    start = States(x, q, v, angular_momentum(q, omega, inertia))
    return fall(start, inverted(inertia), np.array([time_s]), start_time_s=float(motion.times_s[row]), gravity=gravity_world)
