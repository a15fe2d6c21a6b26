"""The last refinement with the camera's focal length among the parameters: the flight's 21 and ``ln f``.

A sequence says more about ``f`` than its pictures one by one: as the particle crosses the picture, the direction it is seen from turns by
``x / f`` while its spin is steady, and perspective adds up over the frames. Still ``f`` and all distances scale together but for that
(``v_z`` with them, the in-plane velocity not), and known gravity is of no help where it lies in the picture's plane. The standard
deviation of ``f`` is therefore reported beside it and goes into the covariance of the velocities.

Gauss-Newton over 22 parameters without the pairs within the sequence, whose say is that of one view; then the refinement at that ``f``.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import particle_poses, unbiased_errors
from estimator.data.fit_task import FitTask
from estimator.fitting.focal_search import LONGEST_STEP, FocalPrior, with_focal_column
from estimator.fitting.refinement import (
    SETTLED,
    STEADY,
    Linearised,
    Refined,
    Refinement,
    covariance_and_bound,
    linearise,
    refine_flight,
    scaled_inverse,
    with_noise_of,
)
from estimator.geometry.focal_derivative import focal_derivative, with_focal
from estimator.geometry.silhouettes import Silhouettes
from estimator.likelihood.composite_likelihood import weigh
from estimator.motion.flight import N_PARAMETERS, Flight, moved, poses_and_sensitivity

Array = NDArray[np.float64]
MOST_STEPS, PASSES = 10, 2
"""Steps with the focal length free, and times that the noise is read again. By judgement."""


@dataclass(frozen=True)
class FocalRefined:
    """The refined flight at the focal length found, ``log_factor`` times the camera's, and its standard deviation ``sigma``.

    ``covariance`` and ``bound`` (22, 22): the flight's parameters, then ``ln f``.
    """

    refined: Refined
    log_factor: float
    sigma: float
    covariance: Array
    bound: Array


def refine_with_focal(task: FitTask, flight: Flight, settings: Refinement, prior: FocalPrior) -> FocalRefined:
    """Refine flight and focal length from a flight that fits at the camera's; the noise is measured anew once ``f`` is about right."""
    given, log_factor, steady = task.sightings.silhouettes, 0.0, False
    alone = replace(settings, within_pairs=0)
    for _ in range(PASSES):
        noisy = _with_noise(_at_focal(task, given, log_factor), flight)
        flight, log_factor, steady = _stepped(noisy, flight, alone, prior, log_factor)
    at_focal = _at_focal(task, given, log_factor)
    refined = refine_flight(at_focal, flight, settings)
    noisy = _with_noise(at_focal, refined.flight)
    at = _with_column(noisy, refined.flight, alone, prior, log_factor)
    known = np.diag(np.append(task.prior.precision, prior.precision))
    covariance, bound = covariance_and_bound(noisy, at, known, settings)
    part = slice(0, N_PARAMETERS)
    refined = replace(refined, covariance=covariance[part, part], bound=bound[part, part], settled=refined.settled and steady)
    return FocalRefined(refined, log_factor, float(np.sqrt(covariance[-1, -1])), covariance, bound)


def _stepped(task: FitTask, flight: Flight, settings: Refinement, prior: FocalPrior, log_factor: float) -> tuple[Flight, float, bool]:
    """Joint steps from silhouettes at ``log_factor``; the flight, the new factor, and whether the steps became small."""
    first, start, steady = task.sightings.silhouettes, log_factor, False
    for _ in range(MOST_STEPS):
        at_focal = _at_focal(task, first, log_factor - start)
        at = _with_column(at_focal, flight, settings, prior, log_factor)
        inverse = scaled_inverse(at.H)
        step = -inverse @ at.g
        step *= min(1.0, LONGEST_STEP / max(abs(float(step[-1])), 1e-300))
        flight, log_factor = moved(flight, step[:-1]), log_factor + float(step[-1])
        size = float(np.max(np.abs(step) / np.sqrt(np.diag(inverse))))
        steady = size < STEADY
        if size < SETTLED:
            break
    return flight, log_factor, steady


def _at_focal(task: FitTask, silhouettes: Silhouettes, log_factor: float) -> FitTask:
    return replace(task, sightings=replace(task.sightings, silhouettes=with_focal(silhouettes, log_factor)))


def _with_noise(task: FitTask, flight: Flight) -> FitTask:
    predicted, _ = poses_and_sensitivity(flight, task.sightings.times_s)
    return with_noise_of(task, unbiased_errors(task, flight, predicted))[0]


def _with_column(task: FitTask, flight: Flight, settings: Refinement, prior: FocalPrior, log_factor: float) -> Linearised:
    """The equations with ``ln f`` as their last parameter."""
    at = linearise(task, flight, settings)
    first, views = task.sightings.silhouettes, task.views
    poses = particle_poses(flight, at.predicted, task.sightings)
    errors = with_focal_column(at.errors, focal_derivative(first, poses, views.silhouettes, views.poses, at.errors))
    S = np.pad(at.S, ((0, 0), (0, 1), (0, 1)))
    S[:, -1, -1] = 1.0
    frames = weigh(errors, S, first, floor_px=settings.floor_px, huber=task.huber)
    held_H, held_g = at.H - at.frames.H, at.g - at.frames.g
    H, g = frames.H + np.pad(held_H, (0, 1)), frames.g + np.pad(held_g, (0, 1))
    H[-1, -1] += prior.precision
    g[-1] += prior.precision * log_factor
    within = replace(at.within, H=np.pad(at.within.H, (0, 1)), g=np.pad(at.within.g, (0, 1)))
    return replace(at, S=S, errors=errors, frames=frames, within=within, H=H, g=g)
