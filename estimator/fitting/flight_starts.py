"""Starts for the trajectory fit: from tracked poses, or from momenta drawn within a limited magnitude."""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from estimator.fitting.tracking import Track
from estimator.fitting.trajectory import FitTask, errors_of, restricted
from estimator.motion.flight import N_PARAMETERS, OMEGA, Flight, FlightPoses, poses
from estimator.motion.rotation import quaternion, rotation_vector

Array = NDArray[np.float64]
SPIN_FRAMES = 7
COMPARED_SIGHTINGS = 16


def flight_of_track(track: Track, body: Body, gravity_world: Array, *, time_s: float) -> Flight:
    """A flight through tracked poses: least squares for position, the median turn between frames near ``time_s`` for the spin.

    ``track`` poses are of the particle frame; ``time_s`` becomes the reference time.
    """
    good = track.cost <= 5.0 * np.median(track.cost)
    t = track.times_s[good] - time_s
    fallen = track.centre[good] - 0.5 * gravity_world * (t**2)[:, None]
    coefficients, *_ = np.linalg.lstsq(np.column_stack([np.ones_like(t), t]), fallen, rcond=None)
    near = np.sort(np.argsort(np.abs(track.times_s - time_s))[:SPIN_FRAMES])
    turn = rotation_vector(track.R[near[1:]] @ np.swapaxes(track.R[near[:-1]], 1, 2)) / np.diff(track.times_s[near])[:, None]
    at = int(near[np.argmin(np.abs(track.times_s[near] - time_s))])
    return Flight(
        time_s=time_s,
        x=coefficients[0],
        q=quaternion(track.R[at] @ body.R_particle_body),
        v=coefficients[1],
        omega=np.median(turn, axis=0),
        body=body,
        com=np.zeros(3),
        inertia=np.zeros(5),
        offset_px=0.0,
        gravity_world=gravity_world,
    )


def best_spin(task: FitTask, flight: Flight, *, limit_rads: float, count: int, rng: np.random.Generator) -> Flight:
    """The flight with the best of ``count`` angular velocities drawn uniformly from the ball of radius ``limit_rads`` (its own among them).

    All candidates fly at once and are compared on every few sightings; a Huber cost keeps a wrong candidate's far frames from deciding.
    """
    task = restricted(task, np.unique(np.linspace(0, len(task.sightings) - 1, COMPARED_SIGHTINGS).round().astype(np.int64)))
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    draws = direction * (limit_rads * rng.uniform(size=(count, 1)) ** (1.0 / 3.0))
    steps = np.zeros((count + 1, N_PARAMETERS))
    steps[1:, OMEGA] = draws - flight.omega
    flown = poses(flight, steps, task.sightings.times_s)
    costs = [
        float(errors_of(task, flight, FlightPoses(flown.centre[:, i : i + 1], flown.R[:, i : i + 1])).cost.sum()) for i in range(count + 1)
    ]
    return Flight(**{**flight.__dict__, "omega": flight.omega + steps[int(np.argmin(costs)), OMEGA]})
