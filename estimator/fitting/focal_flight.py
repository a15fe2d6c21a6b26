"""A free flight before a camera whose focal length is one more block: ``ln f`` beside the flight's 21 parameters.

A sequence says more about ``f`` than its pictures one by one: as the particle crosses the picture, the direction it is seen from turns by
``x / f`` while its spin is steady, and perspective adds up over the frames. Still ``f`` and all distances scale together but for that
(``v_z`` with them, the in-plane velocity not), and known gravity is of no help where it lies in the picture's plane. The standard
deviation of ``f`` is therefore reported beside it and goes into the covariance of the velocities.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import particle_poses
from estimator.data.fit_task import FitTask
from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.focal_derivative import focal_derivative, with_focal
from estimator.motion.blocks import Block, Layout
from estimator.motion.flight import LAYOUT, N_PARAMETERS, Flight, FlightPoses, Motion
from estimator.motion.rigid_body import States

Array = NDArray[np.float64]
LOG_FOCAL = "log_focal"
LONGEST_STEP = 0.3
"""Largest change of ``ln f`` in one step: the linearisation holds no further."""


@dataclass(frozen=True)
class FocalFlight:
    """A flight, and the natural logarithm of the focal length over the camera's, about zero to within ``sigma``."""

    first: Flight
    log_focal: float
    sigma: float

    @property
    def layout(self) -> Layout:
        """The flight's blocks and that of the focal length."""
        return Layout((*LAYOUT.blocks, Block(LOG_FOCAL, ("log_focal_factor",), precision=self.sigma**-2)))

    @property
    def values(self) -> Array:
        """Parameters (22,)."""
        return np.append(self.first.values, self.log_focal)

    def moved(self, step: Array) -> "FocalFlight":
        """After a parameter step (22,), cut to ``LONGEST_STEP`` of ``ln f``."""
        step = step * min(1.0, LONGEST_STEP / max(abs(float(step[-1])), 1e-300))
        return replace(self, first=self.first.moved(step[:N_PARAMETERS]), log_focal=self.log_focal + float(step[-1]))

    def with_first(self, first: Flight) -> "FocalFlight":
        """With another flight."""
        return replace(self, first=first)

    def states(self, steps: Array, times_s: Array) -> States:
        """Those of the flight; ``steps`` (m, 22), ``times_s`` (f,)."""
        return self.first.states(steps[:, :N_PARAMETERS], times_s)


def at_focal(task: FitTask, motion: Motion) -> FitTask:
    """The task as it is seen through the lens of a motion, where that has a block for its focal length."""
    if LOG_FOCAL not in motion.layout.places:
        return task
    (log_focal,) = motion.values[motion.layout[LOG_FOCAL]]
    return replace(task, sightings=replace(task.sightings, silhouettes=with_focal(task.sightings.silhouettes, log_focal)))


def with_focal_block(task: FitTask, at: tuple[Motion, FlightPoses], errors: TangencyErrors, S: Array) -> tuple[TangencyErrors, Array]:
    """Errors and ``S`` (n, 8, p) with a ninth column by the focal length (n, 9, p), where the motion has a block for that."""
    motion, predicted = at
    if LOG_FOCAL not in motion.layout.places:
        return errors, S
    placed = particle_poses(motion.first, predicted, task.sightings)
    by_focal = focal_derivative(task.sightings.silhouettes, placed, task.views.silhouettes, task.views.poses, errors)
    S = np.pad(S, ((0, 0), (0, 1), (0, 0)))
    S[:, -1, motion.layout[LOG_FOCAL]] = 1.0
    return with_focal_column(errors, by_focal), S


def with_focal_column(errors: TangencyErrors, by_focal: Array) -> TangencyErrors:
    """Errors whose Jacobian has the derivative by ``ln f`` as its ninth column; ``by_focal`` (n, k, 4)."""
    return replace(errors, jacobian=np.concatenate([errors.jacobian, by_focal[..., None]], axis=3))
