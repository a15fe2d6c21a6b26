"""The joint fit of all segments of a flight with impacts: one pose at each impact, its time among the parameters.

The same errors, weights and sandwich covariance as for one free flight (:mod:`estimator.fitting.trajectory`,
:mod:`estimator.fitting.refinement`); only poses and their sensitivities come from
:mod:`estimator.motion.piecewise`. So the second segment's silhouettes speak of the first segment's pose and the other way round, and the
covariance goes through the impact.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.levenberg_marquardt import NormalEquations, Problem, Solution, minimise
from estimator.fitting.noise_model import measured_noise, with_noise
from estimator.fitting.plate_contact import PlateHeld, PlateTask, held_by_plate
from estimator.fitting.refinement import (
    FINE_STEPS,
    MOST_STEPS,
    SETTLED,
    STEADY,
    Linearised,
    Refined,
    Refinement,
    covariance_and_bound,
    linearised,
    scaled_inverse,
)
from estimator.fitting.trajectory import FitTask, data_cost, errors_of, pose_map, prior_cost, prior_values, unbiased_errors
from estimator.motion.flight import N_PARAMETERS, FlightPoses
from estimator.motion.piecewise import PiecewiseFlight, moved_piecewise, piecewise_poses, piecewise_sensitivity
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PiecewiseRefined:
    """The refined flight; ``refined`` holds its errors, noise, ``covariance`` and ``bound`` (p, p), and the first segment's flight.

    ``times_s`` (n,): of its sightings. ``held``: what a plate added, where the flight was held to one.
    """

    flight: PiecewiseFlight
    refined: Refined
    times_s: Array
    held: PlateHeld | None = None


def flown(flight: PiecewiseFlight, times_s: Array) -> FlightPoses:
    """Poses (m = 1) at ``times_s``."""
    return piecewise_poses(flight, np.zeros((1, flight.size)), times_s)


def fit_piecewise(task: FitTask, start: PiecewiseFlight, *, max_steps: int = 25, tolerance: float = 1e-5) -> Solution[PiecewiseFlight]:
    """Levenberg-Marquardt from ``start``."""
    problem = Problem(
        cost=lambda flight: _cost(task, flight), linearise=lambda flight: linearise_piecewise(task, flight), move=moved_piecewise
    )
    return minimise(problem, start, max_steps=max_steps, tolerance=tolerance)


def _cost(task: FitTask, flight: PiecewiseFlight) -> float:
    if not in_order(flight):
        return float("inf")
    try:
        predicted = flown(flight, task.sightings.times_s)
    except RanAway:
        return float("inf")
    return data_cost(task, errors_of(task, flight.first, predicted)) + prior_cost(task, flight.first)


def in_order(flight: PiecewiseFlight) -> bool:
    """Whether the first flight's reference time and the impacts follow one another."""
    return bool(np.all(np.diff([flight.first.time_s, *flight.times_s]) > 0.0))


def linearise_piecewise(task: FitTask, flight: PiecewiseFlight) -> NormalEquations:
    """Normal equations of the fit's cost at a flight."""
    predicted, sensitivity = piecewise_sensitivity(flight, task.sightings.times_s)
    errors = errors_of(task, flight.first, predicted)
    S = pose_map(sensitivity)
    precision = np.pad(task.prior.precision, (0, flight.size - N_PARAMETERS))
    values = np.pad(prior_values(flight.first), (0, flight.size - N_PARAMETERS))
    H = np.einsum("nap,nab,nbq->pq", S, errors.normal, S, optimize=True) + np.diag(precision)
    g = np.einsum("nap,na->p", S, errors.gradient) + precision * values
    return NormalEquations(H=H, g=g, cost=data_cost(task, errors) + prior_cost(task, flight.first))


def refine_piecewise(task: FitTask, flight: PiecewiseFlight, settings: Refinement, plate: PlateTask | None = None) -> PiecewiseRefined:
    """Gauss-Newton steps with refreshed weights until they are small, as :func:`estimator.fitting.refinement.refine_flight`.

    With ``plate``, the flight is held to it; what that says counts as known, like the prior, in the covariance.
    """
    times, settled = task.sightings.times_s, False
    noise = measured_noise(unbiased_errors(task, flight.first, flown(flight, times)))
    task = replace(task, sightings=replace(task.sightings, silhouettes=with_noise(task.sightings.silhouettes, noise)))
    held = None if plate is None else held_by_plate(plate, flight, times)
    at = _with_plate(linearised(task, flight.first, piecewise_sensitivity(flight, times), settings), held)
    for count in range(1, MOST_STEPS + 1):
        inverse = scaled_inverse(at.H)
        step = -inverse @ at.g
        moved = moved_piecewise(flight, step)
        if not in_order(moved):
            break
        try:
            motion = piecewise_sensitivity(moved, times)
            held = None if plate is None else held_by_plate(plate, moved, times)
        except RanAway:
            settled = False
            break
        flight, at = moved, _with_plate(linearised(task, moved.first, motion, settings), held)
        size = float(np.max(np.abs(step) / np.sqrt(np.diag(inverse))))
        settled = size < STEADY
        if size < SETTLED or (settled and count >= FINE_STEPS):
            break
    known = np.diag(np.pad(task.prior.precision, (0, flight.size - N_PARAMETERS)))
    known = known if held is None else known + held.equations.H
    covariance, bound = covariance_and_bound(task, at, known, settings)
    places = np.column_stack([task.sightings.camera, task.sightings.frame])
    refined = Refined(flight.first, at.predicted, covariance, bound, at.errors, at.frames, at.within, settled, noise, places)
    return PiecewiseRefined(flight, refined, times, held)


def _with_plate(at: Linearised, held: PlateHeld | None) -> Linearised:
    return at if held is None else replace(at, H=at.H + held.equations.H, g=at.g + held.equations.g)
