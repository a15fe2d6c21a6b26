"""The last refinement of a flight: composite likelihood, pairs within the sequence, covariance and bound."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import body_normals, unbiased_errors
from estimator.data.fit_task import FitTask
from estimator.fitting.trajectory import pose_map, prior_values
from estimator.fitting.within_sequence import WithinEquations, within_equations
from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.likelihood.body_fixed_error import COARSE, body_noise, body_places
from estimator.likelihood.composite_likelihood import WeighedFrames, information, shared_view_noise, weigh
from estimator.likelihood.noise_model import MeasuredNoise, measured_noise, with_noise
from estimator.motion.flight import N_PARAMETERS, Flight, FlightPoses, moved, poses_and_sensitivity
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
MOST_STEPS, FINE_STEPS = 24, 8
"""Steps of the last refinement, and those after which a coarser end is enough (below)."""
SETTLED, STEADY = 0.1, 0.3
"""Shares of the standard deviations: a smaller step ends the refinement; tangencies that change places may leave steps up to the second.

So after ``FINE_STEPS`` steps the second is enough. A first fit in other weights may be ten standard deviations off, and takes more steps.
"""
LEAST_CURVATURE = 1e-12
"""A normal matrix, scaled to a diagonal of ones, whose least eigenvalue is below has an inverse of rounding: variances may be negative."""
State = TypeVar("State")
Known = TypeVar("Known")


class NothingSeen(RanAway):
    """A fit that has come to where the sightings say nothing of some of its parameters."""


NOTHING_SEEN = "nothing is seen of a parameter where the fit has come to"


@dataclass(frozen=True)
class Refined:
    """The refined flight, ``covariance`` and ``bound`` (21, 21), its errors, their whitening, whether the steps settled.

    And the noise found; ``places`` (n, 2): camera and frame of each sighting.
    """

    flight: Flight
    predicted: FlightPoses
    covariance: Array
    bound: Array
    errors: TangencyErrors
    frames: WeighedFrames
    within: WithinEquations
    settled: bool
    noise: MeasuredNoise
    places: NDArray[np.int64]


@dataclass(frozen=True)
class Linearised:
    """Errors and their normal equations ``H`` (p, p), ``g`` (p,), prior included, at one flight; ``S`` as in :func:`pose_map`.

    ``S`` (n, 8, p); ``normals`` (n, k, 2, 3), body axes.
    """

    predicted: FlightPoses
    S: Array
    errors: TangencyErrors
    frames: WeighedFrames
    within: WithinEquations
    normals: Array
    H: Array
    g: Array


@dataclass(frozen=True)
class Refinement:
    """Settings: see :class:`estimator.data.configuration.Configuration`."""

    floor_px: float
    body_noise_px: float
    within_pairs: int


def refine_flight(task: FitTask, flight: Flight, settings: Refinement) -> Refined:
    """Gauss-Newton steps with refreshed weights until they are small against the standard deviations."""
    predicted, _ = poses_and_sensitivity(flight, task.sightings.times_s)
    task, noise = with_noise_of(task, unbiased_errors(task, flight, predicted))

    def further(flight: Flight, step: Array) -> tuple[Flight, Linearised]:
        there = moved(flight, step)
        return there, linearise(task, there, settings)

    flight, at, settled = stepped((flight, linearise(task, flight, settings)), lambda at: (at.H, at.g), further)
    covariance, bound = covariance_and_bound(task, at, np.diag(task.prior.precision), settings)
    places = np.column_stack([task.sightings.camera, task.sightings.frame])
    return Refined(flight, at.predicted, covariance, bound, at.errors, at.frames, at.within, settled, noise, places)


def with_noise_of(task: FitTask, errors: TangencyErrors) -> tuple[FitTask, MeasuredNoise]:
    """The task with the noise that ``errors`` of a flight show, and that noise."""
    noise = measured_noise(errors)
    return replace(task, sightings=replace(task.sightings, silhouettes=with_noise(task.sightings.silhouettes, noise))), noise


def stepped(
    start: tuple[State, Known],
    system: Callable[[Known], tuple[Array, Array]],
    further: Callable[[State, Array], tuple[State, Known] | None],
) -> tuple[State, Known, bool]:
    """Gauss-Newton steps from a state and what is known there until they are small; the last of both, and whether they became so.

    ``system``: the normal matrix and gradient of what is known. ``further``: the state after a step and what is known there; ``None`` where
    the steps end before it. After ``FINE_STEPS`` a step that turns back from the one before is halved: weights that change from
    step to step can throw the state from one side of its end to the other for ever.
    """
    (state, known), settled, last = start, False, None
    for count in range(1, MOST_STEPS + 1):
        H, g = system(known)
        inverse = scaled_inverse(H)
        step = -inverse @ g
        back = last is not None and count > FINE_STEPS and float(last @ H @ step) < 0.0
        last = step
        try:
            reached = further(state, 0.5 * step if back else step)
        except RanAway:
            settled = False
            break
        if reached is None:
            break
        state, known = reached
        size = float(np.max(np.abs(step) / np.sqrt(np.diag(inverse))))
        settled = size < STEADY
        if size < SETTLED or (settled and count >= FINE_STEPS):
            break
    return state, known, settled


def covariance_and_bound(task: FitTask, at: Linearised, prior: Array, settings: Refinement) -> tuple[Array, Array]:
    """Sandwich covariance and Cramér-Rao-type bound (p, p) each; ``prior`` (p, p) is the prior's information.

    Raises
    ------
    NothingSeen
        Where there is none: the sightings say nothing of some parameter, or of some combination of them.
    """
    covariance = sandwich(task, at, prior, settings)
    viewing = (task.sightings.R_cam_world @ at.predicted.R[:, 0])[:, 2]
    own = task.sightings.silhouettes
    known = information(at.errors, at.S, own, (body_places(at.normals, viewing, COARSE), settings.body_noise_px), huber=task.huber)
    bound = scaled_inverse(known / max(1.0, at.frames.mean_square) + prior)
    return covariance, 0.5 * (bound + bound.T)


def sandwich(task: FitTask, at: Linearised, prior: Array, settings: Refinement) -> Array:
    """Covariance (p, p) of the parameters: own noise of the outlines, that of the views and the body-fixed error.

    ``prior`` (p, p): its information.

    Raises
    ------
    NothingSeen
        Where there is none.
    """
    inverse = scaled_inverse(determined(at.H))
    shared = shared_view_noise(at.errors, at.frames.weighted, task.views.silhouettes)
    viewing = (task.sightings.R_cam_world @ at.predicted.R[:, 0])[:, 2]
    shared = shared + body_noise(at.errors.valid, at.frames.weighted, body_places(at.normals, viewing), sigma_px=settings.body_noise_px)
    covariance = inverse @ (max(1.0, at.frames.mean_square) * (at.frames.meat + at.within.H + shared) + prior) @ inverse
    return np.asarray(0.5 * (covariance + covariance.T))


def scaled_inverse(H: Array) -> Array:
    """Inverse of a normal matrix whose parameters have units far apart.

    ``H`` (p, p).

    Raises
    ------
    NothingSeen
        Where it has none: the sightings say nothing of some parameter there.
    """
    scale = _scale(H)
    try:
        return np.asarray(np.linalg.inv(H * scale[:, None] * scale) * scale[:, None] * scale)
    except np.linalg.LinAlgError:
        raise NothingSeen(NOTHING_SEEN) from None


def determined(H: Array) -> Array:
    """A normal matrix whose inverse is more than rounding; ``H`` (p, p)."""
    scale = _scale(H)
    scaled = H * scale[:, None] * scale
    if not (np.isfinite(scaled).all() and np.linalg.eigvalsh(scaled)[0] > LEAST_CURVATURE):
        raise NothingSeen(NOTHING_SEEN)
    return H


def _scale(H: Array) -> Array:
    return np.asarray(1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300)))


def linearise(task: FitTask, flight: Flight, settings: Refinement) -> Linearised:
    """Weighed errors with views and within the sequence under a flight."""
    return linearised(task, flight, poses_and_sensitivity(flight, task.sightings.times_s), settings)


def linearised(task: FitTask, flight: Flight, motion: tuple[FlightPoses, Array], settings: Refinement) -> Linearised:
    """The same for poses and sensitivities (n, 6, p) given as ``motion``; the first 21 of their parameters are those of ``flight``.

    ``motion``: poses, and sensitivities (n, 6, p).
    """
    predicted, sensitivity = motion
    errors = unbiased_errors(task, flight, predicted)
    S = pose_map(sensitivity)
    normals = body_normals(task.sightings, task.sightings.R_cam_world @ predicted.R[:, 0], errors)
    frames = weigh(errors, S, task.sightings.silhouettes, floor_px=settings.floor_px, huber=task.huber)
    within = within_equations(task, flight, predicted, S, most_pairs=settings.within_pairs, floor_px=settings.floor_px)
    more = S.shape[2] - N_PARAMETERS
    precision = np.pad(task.prior.precision, (0, more))
    H = frames.H + within.H + np.diag(precision)
    g = frames.g + within.g + precision * np.pad(prior_values(flight), (0, more))
    return Linearised(predicted, S, errors, frames, within, normals, H, g)
