"""The joint fit of all segments of a flight with impacts: one pose at each impact, its time among the parameters.

The same errors, weights and sandwich covariance as for one free flight (:mod:`estimator.fitting.trajectory`,
:mod:`estimator.fitting.refinement`); only poses and their sensitivities come from
:mod:`estimator.motion.piecewise`. So the second segment's silhouettes speak of the first segment's pose and the other way round, and the
covariance goes through the impact.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import errors_of, unbiased_errors
from estimator.data.fit_task import FitTask
from estimator.fitting.levenberg_marquardt import NormalEquations, Problem, Solution, minimise
from estimator.fitting.refinement import (
    Linearised,
    Refined,
    Refinement,
    covariance_and_bound,
    linearised,
    scaled_inverse,
    stepped,
    with_noise_of,
)
from estimator.fitting.trajectory import data_cost, pose_map, prior_cost, prior_values
from estimator.impacts.loose_contact import LONGEST_SPREAD_S, LooseContact, loose_contact, loose_sensitivity, moved_loose, spread_equations
from estimator.impacts.plate_contact import PlateHeld, PlateTask, held_by_plate
from estimator.likelihood.noise_model import MeasuredNoise
from estimator.motion.flight import N_PARAMETERS, FlightPoses
from estimator.motion.piecewise import PiecewiseFlight, moved_piecewise, piecewise_poses, piecewise_sensitivity
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
FAR_MEAN_SQUARE, MOST_AGAIN = 4.0, 2
"""Of errors over their stated variance: above it the noise is read again, so many times at most (notebook 15)."""

Seen = tuple[Linearised, NormalEquations, PlateHeld | None]
"""The equations at a flight, what is known in them besides outlines and prior, and what a plate added."""


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
    """Poses (m = 1) at ``times_s`` (f,) s."""
    return piecewise_poses(flight, np.zeros((1, flight.size)), times_s)


def fit_piecewise(task: FitTask, start: PiecewiseFlight, *, max_steps: int = 25, tolerance: float = 1e-5) -> Solution[PiecewiseFlight]:
    """Levenberg-Marquardt from ``start``."""
    problem = Problem(
        cost=lambda flight: piecewise_cost(task, flight), linearise=lambda flight: linearise_piecewise(task, flight), move=moved_piecewise
    )
    return minimise(problem, start, max_steps=max_steps, tolerance=tolerance)


def piecewise_cost(task: FitTask, flight: PiecewiseFlight) -> float:
    """What the fit minimises; infinite for flights that cannot be flown."""
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


def refine_piecewise(
    task: FitTask,
    flight: PiecewiseFlight,
    settings: Refinement,
    plate: PlateTask | None = None,
    loose: tuple[LooseContact, ...] = (),
) -> PiecewiseRefined:
    """Gauss-Newton steps with refreshed weights until they are small, as :func:`estimator.fitting.refinement.refine_flight`.

    With ``plate``, the flight is held to it; what that says counts as known, like the prior, in the covariance. The impacts of ``loose``
    may have a pose before and another one after them; covariance and bound are those of the other parameters.

    The size of the noise is read off the errors of the flight that came. Where these are far above it, because frames around an impact were
    left out and the flight after it was not yet found, it is read again where the steps led.
    """
    refined = _refined_once(task, flight, settings, plate, loose)
    for _ in range(MOST_AGAIN):
        if refined.refined.noise.mean_square <= FAR_MEAN_SQUARE:
            break
        again = _refined_once(task, refined.flight, settings, plate, loose)
        if again.refined.noise.mean_square >= refined.refined.noise.mean_square:
            break
        refined = again
    return refined


def widened_by(task: FitTask, refined: PiecewiseRefined, settings: Refinement, loose: tuple[LooseContact, ...]) -> PiecewiseRefined:
    """A refined flight, not moved, with intervals that allow for impacts of several contacts.

    The covariance is the one with the impacts of ``loose`` loosened, and the step to where that would lead, times itself.
    """
    task, flight = with_noise_at(task, refined.flight)[0], refined.flight
    at, known, _ = seen_at(task, flight, settings, (None, loose))
    covariance, bound = (c[: flight.size, : flight.size] for c in _covariance_and_bound(task, at, known.H, settings))
    step = (scaled_inverse(at.H) @ at.g)[: flight.size]
    return replace(refined, refined=replace(refined.refined, covariance=covariance + np.outer(step, step), bound=bound))


def _refined_once(
    task: FitTask, flight: PiecewiseFlight, settings: Refinement, plate: PlateTask | None, loose: tuple[LooseContact, ...]
) -> PiecewiseRefined:
    task, noise = with_noise_at(task, flight)

    def further(flight: PiecewiseFlight, step: Array) -> tuple[PiecewiseFlight, Seen] | None:
        there = moved_loose(flight, step, loose)
        return (there, seen_at(task, there, settings, (plate, loose))) if in_order(there) else None

    start = (flight, seen_at(task, flight, settings, (plate, loose)))
    flight, (at, known, held), settled = stepped(start, lambda seen: (seen[0].H, seen[0].g), further)
    covariance, bound = (c[: flight.size, : flight.size] for c in _covariance_and_bound(task, at, known.H, settings))
    places = np.column_stack([task.sightings.camera, task.sightings.frame])
    refined = Refined(flight.first, at.predicted, covariance, bound, at.errors, at.frames, at.within, settled, noise, places)
    return PiecewiseRefined(flight, refined, task.sightings.times_s, held)


def seen_at(
    task: FitTask, flight: PiecewiseFlight, settings: Refinement, besides: tuple[PlateTask | None, tuple[LooseContact, ...]]
) -> Seen:
    """The equations at a flight, ``besides``: a plate that it is held to, and impacts whose poses before and after may differ."""
    motion = loose_sensitivity(flight, task.sightings.times_s, besides[1])
    known, held = _known(task, flight, *besides)
    return _with_known(linearised(task, flight.first, motion, settings), known), known, held


def _covariance_and_bound(task: FitTask, at: Linearised, known: Array | float, settings: Refinement) -> tuple[Array, Array]:
    """Of all parameters that ``at`` has; ``known``: the normal matrix of what is known besides outlines and prior."""
    prior = np.diag(np.pad(task.prior.precision, (0, len(at.g) - N_PARAMETERS)))
    return covariance_and_bound(task, at, prior + known, settings)


def with_noise_at(task: FitTask, flight: PiecewiseFlight) -> tuple[FitTask, MeasuredNoise]:
    """The task with the noise that its errors under a flight show, and that noise."""
    return with_noise_of(task, unbiased_errors(task, flight.first, flown(flight, task.sightings.times_s)))


def spread_at(task: FitTask, flight: PiecewiseFlight, number: int, settings: Refinement) -> tuple[Array, Array]:
    """What the outlines say of a shift at impact ``number`` of a refined flight: z (5,) s, from one step, and its covariance."""
    task, _ = with_noise_at(task, flight)
    loose = (loose_contact(flight, number, LONGEST_SPREAD_S),)
    at = linearised(task, flight.first, loose_sensitivity(flight, task.sightings.times_s, loose), settings)
    covariance, _ = _covariance_and_bound(task, at, 0.0, settings)
    return -(scaled_inverse(at.H) @ at.g)[flight.size :], covariance[flight.size :, flight.size :]


def _known(
    task: FitTask, flight: PiecewiseFlight, plate: PlateTask | None, loose: tuple[LooseContact, ...]
) -> tuple[NormalEquations, PlateHeld | None]:
    """What is known besides outlines and prior: how far loose contacts may spread, and where the plate is."""
    known = spread_equations(flight, loose)
    if plate is None:
        return known, None
    held = held_by_plate(plate, flight, task.sightings.times_s)
    more = (0, len(known.g) - flight.size)
    H, g = np.pad(held.equations.H, more), np.pad(held.equations.g, more)
    return NormalEquations(known.H + H, known.g + g, known.cost + held.equations.cost), held


def _with_known(at: Linearised, known: NormalEquations) -> Linearised:
    return replace(at, H=at.H + known.H, g=at.g + known.g)
