"""Clocks of cameras that are not known: found roughly by one camera's flight, so that poses are searched in the pictures of all.

A camera by itself needs no other clock than its own. The flight that it alone shows is fitted to the outlines of all cameras, their clocks
free within what is stated of them; the search then goes by stamps that are corrected by what was found. The last fits begin with the stamps
as they are and keep the clocks among their parameters (:mod:`estimator.motion.clocked`).
"""

from dataclasses import replace

import numpy as np

from datasets.observation import Observation
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask, restricted
from estimator.fitting.trajectory import fit
from estimator.motion.clocked import CameraClock, ClockedMotion, true_times
from estimator.motion.flight import Flight, Motion
from estimator.particle.particle import Particle
from estimator.search.candidate_flights import candidate_flights, first_pose


def unknown_clocks(observation: Observation) -> tuple[CameraClock, ...]:
    """Of the cameras whose clocks are not known exactly."""
    return tuple(
        CameraClock(number, camera.name, float(clock.times_s[0]), clock.offset_sigma_s, clock.rate_sigma)
        for number, (camera, clock) in enumerate(zip(observation.cameras, observation.clocks, strict=True))
        if not clock.known
    )


def aligned(observation: Observation, task: FitTask, particle: Particle, configuration: Configuration) -> FitTask:
    """The task with the stamps of all cameras by the first one's clock, as well as a first fit tells; as it is where clocks are known.

    Raises
    ------
    NoMeasurement
        Where no flight fits one camera's outlines.
    """
    clocks = unknown_clocks(observation)
    if not clocks or len(np.unique(task.sightings.camera)) < 2:
        return task
    alone = restricted(task, _of_one_camera(task, configuration))
    start = first_pose(alone, particle, configuration)
    flight = candidate_flights(observation, alone, particle, start, configuration)[0].solution.state
    found, sightings = with_clocks(task, flight, clocks), task.sightings
    return replace(task, sightings=replace(sightings, times_s=true_times(found, sightings.camera, sightings.times_s)))


def with_clocks(task: FitTask, flight: Flight, clocks: tuple[CameraClock, ...]) -> Motion:
    """A flight fitted to all outlines with the offsets of ``clocks`` free; as it is where there are none of them."""
    if not clocks:
        return flight
    return fit(task, ClockedMotion(flight, clocks, np.zeros(sum(len(clock.block.labels) for clock in clocks)))).state


def _of_one_camera(task: FitTask, configuration: Configuration) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Sightings (k,) of the first camera, or of the one with most where that has few."""
    camera = task.sightings.camera
    counts = np.bincount(camera)
    chosen = 0 if counts[0] >= configuration.minimum_frames else int(np.argmax(counts))
    return np.flatnonzero(camera == chosen).astype(np.int64)
