"""Tangency errors of one particle's outlines as the last refinement weighs them: composite likelihood, pairs within the sequence."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import body_normals, sensitivity_in, unbiased_errors
from estimator.data.fit_task import FitTask
from estimator.fitting.focal_flight import at_focal, with_focal_block
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.within_sequence import WithinEquations, within_equations
from estimator.geometry.epipolar_tangency import N_COLUMNS, TangencyErrors
from estimator.likelihood.body_fixed_error import COARSE, body_noise, body_places
from estimator.likelihood.composite_likelihood import WeighedFrames, information, shared_view_noise, weigh
from estimator.motion.flight import OFFSET, FlightPoses, Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Refinement:
    """Settings: see :class:`estimator.data.configuration.Configuration`."""

    floor_px: float
    body_noise_px: float
    within_pairs: int


@dataclass(frozen=True)
class Linearised(NormalEquations):
    """Normal equations of c parameters from the outlines of a ``task`` at one motion, and what they are made of.

    ``S`` as in :func:`pose_map`; the cost is half the squares of the standardised errors with views.

    ``S`` (n, 8, c); ``normals`` (n, k, 2, 3), body axes.
    """

    task: FitTask
    settings: Refinement
    predicted: FlightPoses
    S: Array
    errors: TangencyErrors
    frames: WeighedFrames
    within: WithinEquations
    normals: Array

    @property
    def spread(self) -> Array:
        """Covariance (c, c) of the gradient: own noise of the outlines, that of the views and the body-fixed error."""
        shared = shared_view_noise(self.errors, self.frames.weighted, self.task.views.silhouettes)
        places = body_places(self.normals, self._viewing)
        shared = shared + body_noise(self.errors.valid, self.frames.weighted, places, sigma_px=self.settings.body_noise_px)
        return np.asarray(max(1.0, self.frames.mean_square) * (self.frames.meat + self.within.H + shared))

    @property
    def information(self) -> Array:
        """Fisher information (c, c)."""
        body = body_places(self.normals, self._viewing, COARSE), self.settings.body_noise_px
        known = information(self.errors, self.S, self.task.sightings.silhouettes, body, huber=self.task.huber)
        return known / max(1.0, self.frames.mean_square)

    @property
    def _viewing(self) -> Array:
        return (self.task.sightings.R_cam_world @ self.predicted.R[:, 0])[:, 2]


def linearise(task: FitTask, motion: Motion, settings: Refinement, more: Array | None = None) -> Linearised:
    """Weighed errors with views and within the sequence under a motion.

    ``more`` (n, 6, c): sensitivities of the poses to further parameters.
    """
    seen, (predicted, sensitivity) = at_focal(task, motion), sensitivity_in(motion, task.sightings)
    if more is not None:
        sensitivity = np.concatenate([sensitivity, more], axis=2)
    errors = unbiased_errors(seen, motion.first, predicted)
    normals = body_normals(seen.sightings, seen.sightings.R_cam_world @ predicted.R[:, 0], errors)
    errors, S = with_focal_block(seen, (motion, predicted), errors, pose_map(sensitivity))
    frames = weigh(errors, S, seen.sightings.silhouettes, floor_px=settings.floor_px, huber=task.huber)
    within = within_equations(seen, motion, predicted, S, most_pairs=settings.within_pairs, floor_px=settings.floor_px)
    H, g, cost = frames.H + within.H, frames.g + within.g, 0.5 * float(frames.chi2.sum())
    return Linearised(H, g, cost, task, settings, predicted, S, errors, frames, within, normals)


def pose_map(sensitivity: Array) -> Array:
    """``S`` (n, 8, p): pair columns (pose, offset of the sighting, offset of the view) by parameters, the first of them those of a flight.

    ``sensitivity`` (n, 6, p) of the poses.
    """
    S = np.zeros((len(sensitivity), N_COLUMNS, sensitivity.shape[2]))
    S[:, :6] = sensitivity
    S[:, 6, OFFSET] = -1.0
    return S
