"""Starts for the trajectory fit: from tracked poses, or from momenta drawn within a limited magnitude.

Seen from some sides a body turns by degrees without changing its outline much. Tracked poses are then right but loose there, and turns
between neighbouring frames are useless as spin. So :func:`starts_along` also starts elsewhere on the track and reads the spin over wider
windows.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from estimator.appearance.flight_errors import errors_of
from estimator.data.fit_task import FitTask, restricted
from estimator.motion.flight import N_PARAMETERS, OMEGA, Flight, FlightPoses, Motion, flown, poses, still, velocities
from estimator.motion.rotation import quaternion, rotation_from_vector, rotation_vector
from estimator.search.tracking import Track

Array = NDArray[np.float64]
SPIN_FRAMES = 7
"""Tracked pictures of which a first spin is taken: it changes little in so many. By judgement."""
COMPARED_SIGHTINGS = 16
"""Sightings, spread evenly, in which drawn spins are compared. By judgement."""
ANCHORS = 7
"""Places along a track at which flights are begun anew. By judgement."""
SPIN_WINDOWS = (7, 15, 31)
"""Pictures about such a place of which a spin is taken: few where it changes, many where it is slow. By judgement."""


def flight_of_track(track: Track, body: Body, gravity_world: Array, *, time_s: float) -> Flight:
    """A flight through tracked poses: least squares for position, the median turn between frames near ``time_s`` for the spin.

    ``track`` poses are of the particle frame; ``time_s`` becomes the reference time.
    ``gravity_world`` (3,) m/s².
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


def starts_along(track: Track, body: Body, gravity_world: Array) -> list[Flight]:
    """Flights through tracked poses with reference times spread over the track and spins from narrow and wide windows.

    ``gravity_world`` (3,) m/s².
    """
    anchors = np.unique(np.linspace(0, len(track.times_s) - 1, ANCHORS + 2).round().astype(np.int64)[1:-1])
    return [
        replace(flight_of_track(track, body, gravity_world, time_s=float(track.times_s[at])), omega=_spin_near(track, int(at), window))
        for at in anchors
        for window in SPIN_WINDOWS
    ]


def _spin_near(track: Track, at: int, frames: int) -> Array:
    """Angular velocity (3,) rad/s, world frame: the median turn over half a window of ``frames``, turns of neighbours taken off first.

    Without those a wide window would count turns beyond half a revolution the wrong way round.
    """
    near = np.sort(np.argsort(np.abs(track.times_s - track.times_s[at]), kind="stable")[:frames])
    spin = np.zeros(3)
    for lag in (1, max(len(near) // 2, 1)):
        a, b = near[:-lag], near[lag:]
        apart_s = (track.times_s[b] - track.times_s[a])[:, None]
        left = track.R[b] @ np.swapaxes(rotation_from_vector(spin * apart_s) @ track.R[a], 1, 2)
        spin = spin + np.median(rotation_vector(left) / apart_s, axis=0)
    return spin


def best_start(task: FitTask, starts: list[Flight]) -> Flight:
    """The start with the smallest Huber cost on every few sightings of the whole sequence."""
    task = _every_few(task)
    costs = [float(errors_of(task, start, flown(start, task.sightings.times_s)).cost.sum()) for start in starts]
    return starts[int(np.argmin(costs))]


def at_time(motion: Motion, time_s: float) -> Flight:
    """The flight that a motion is at a time, with that as its reference time."""
    reached = motion.states(still(motion), np.array([time_s]))
    v, omega = velocities(motion, still(motion), time_s)
    return replace(motion.first, time_s=time_s, x=reached.x[0, 0], q=reached.q[0, 0], v=v[0], omega=omega[0])


def _every_few(task: FitTask) -> FitTask:
    return restricted(task, np.unique(np.linspace(0, len(task.sightings) - 1, COMPARED_SIGHTINGS).round().astype(np.int64)))


def best_spin(task: FitTask, flight: Flight, *, limit_rads: float, count: int, rng: np.random.Generator) -> Flight:
    """The flight with the best of ``count`` angular velocities drawn uniformly from the ball of radius ``limit_rads`` (its own among them).

    All candidates fly at once and are compared on every few sightings; a Huber cost keeps a wrong candidate's far frames from deciding.
    """
    task = _every_few(task)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    draws = direction * (limit_rads * rng.uniform(size=(count, 1)) ** (1.0 / 3.0))
    steps = np.zeros((count + 1, N_PARAMETERS))
    steps[1:, OMEGA] = draws - flight.omega
    every = poses(flight, steps, task.sightings.times_s)
    costs = [
        float(errors_of(task, flight, FlightPoses(every.centre[:, i : i + 1], every.R[:, i : i + 1])).cost.sum()) for i in range(count + 1)
    ]
    return replace(flight, omega=flight.omega + steps[int(np.argmin(costs)), OMEGA])
