"""The trajectory fit: one flight to all silhouettes of a sequence.

Each silhouette contributes an 8x8 normal matrix in its own pose and outline offset; with ``S_i = d pose_i / d parameters`` the whole
fit's is ``sum S_iᵀ H_i S_i``. The cost of a step is thus independent of the number of parameters.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import errors_of
from estimator.data.fit_task import FitTask, restricted
from estimator.fitting.levenberg_marquardt import NormalEquations, Outcome, Problem, Solution, minimise
from estimator.geometry.epipolar_tangency import N_COLUMNS, TangencyErrors
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, Flight, moved, poses, poses_and_sensitivity
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]


WINDOW_GROWTH = 2.5
"""How many times more sightings each next fit has. By judgement."""
FIRST_WINDOW = 9
"""Sightings of one camera of the first fit: a flight turns little in so many. By judgement."""


def fit_growing(task: FitTask, start: Flight) -> Solution[Flight]:
    """Fit the sightings nearest the reference time, then more and more of them: a small error of the spin never gets a turn ahead."""
    order = np.argsort(np.abs(task.sightings.times_s - start.time_s), kind="stable")
    count, flight = FIRST_WINDOW * len(task.sightings.cameras), start
    while count < len(order):
        flight = fit(restricted(task, np.sort(order[:count])), flight, max_steps=10, tolerance=1e-3).state
        count = int(count * WINDOW_GROWTH)
    return fit(task, flight)


def fit(task: FitTask, start: Flight, *, max_steps: int = 25, tolerance: float = 1e-5) -> Solution[Flight]:
    """Levenberg-Marquardt from ``start``; of infinite cost where that cannot be flown."""
    problem = Problem(
        cost=lambda flight: _cost(task, flight),
        linearise=lambda flight: _linearise(task, flight),
        move=moved,
    )
    try:
        return minimise(problem, start, max_steps=max_steps, tolerance=tolerance)
    except RanAway:
        return Solution(start, NormalEquations(np.eye(N_PARAMETERS), np.zeros(N_PARAMETERS), np.inf), Outcome.STALLED, 0)


def pose_map(sensitivity: Array) -> Array:
    """``S`` (n, 8, p): pair columns (pose, offset of the sighting, offset of the view) by parameters, the first 21 those of a flight.

    ``sensitivity`` (n, 6, p) of the poses.
    """
    S = np.zeros((len(sensitivity), N_COLUMNS, sensitivity.shape[2]))
    S[:, :6] = sensitivity
    S[:, 6, OFFSET] = -1.0
    return S


def data_cost(task: FitTask, errors: TangencyErrors) -> float:
    """Cost scaled up for pairs without tangent planes, so that losing pairs never pays."""
    wanted = np.count_nonzero(task.weight)
    valid = np.count_nonzero(errors.valid)
    return float(errors.cost.sum()) * wanted / valid if valid else np.inf


def prior_cost(task: FitTask, flight: Flight) -> float:
    """Cost of the parameters that the prior holds near zero."""
    p = prior_values(flight)
    return 0.5 * float(p @ (task.prior.precision * p))


def prior_values(flight: Flight) -> Array:
    """Parameters (21,) of a flight that the prior holds near zero."""
    values = np.zeros(N_PARAMETERS)
    values[COM], values[INERTIA], values[OFFSET] = flight.com, flight.inertia, flight.offset_px
    return values


def _cost(task: FitTask, flight: Flight) -> float:
    try:
        predicted = poses(flight, np.zeros((1, N_PARAMETERS)), task.sightings.times_s)
    except RanAway:
        return np.inf
    return data_cost(task, errors_of(task, flight, predicted)) + prior_cost(task, flight)


def _linearise(task: FitTask, flight: Flight) -> NormalEquations:
    predicted, sensitivity = poses_and_sensitivity(flight, task.sightings.times_s)
    errors = errors_of(task, flight, predicted)
    S = pose_map(sensitivity)
    precision = task.prior.precision
    H = np.einsum("nap,nab,nbq->pq", S, errors.normal, S, optimize=True) + np.diag(precision)
    g = np.einsum("nap,na->p", S, errors.gradient) + precision * prior_values(flight)
    return NormalEquations(H=H, g=g, cost=data_cost(task, errors) + prior_cost(task, flight))
