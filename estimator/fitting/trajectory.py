"""The trajectory fit: a motion to all silhouettes of a sequence, by tangency errors that count alike.

Each silhouette contributes an 8x8 normal matrix in its own pose and outline offset; with ``S_i = d pose_i / d parameters`` the whole
fit's is ``sum S_iᵀ H_i S_i``. The cost of a step is thus independent of the number of parameters.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import errors_of, flown_in, sensitivity_in
from estimator.data.fit_task import FitTask, restricted
from estimator.fitting.levenberg_marquardt import Descent, NormalEquations, Outcome, Solution, minimise
from estimator.fitting.problem import M, Part, Problem, S, alone, prior_of
from estimator.fitting.weighed_tangencies import pose_map
from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.motion.flight import Flight, Motion
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


def fit(task: FitTask, start: M, *, max_steps: int = 25, tolerance: float = 1e-5) -> Solution[M]:
    """Levenberg-Marquardt from ``start``; of infinite cost where that cannot be flown."""
    return fit_jointly(alone(task, start), start, max_steps=max_steps, tolerance=tolerance)


def fit_jointly(parts: Sequence[Part[S, M]], start: S, *, max_steps: int = 25, tolerance: float = 1e-5) -> Solution[S]:
    """The same of all parts of a problem."""
    problem: Problem[S, M, NormalEquations] = Problem(tuple(parts), equations)

    def cost_of(state: S) -> float:
        return sum(cost(part.task, part.motion(state)) for part in parts) + prior_of(parts, state).cost

    def linearised(state: S) -> NormalEquations:
        system = problem.at(state)
        return NormalEquations(system.H, system.g, system.cost)

    try:
        descent = Descent(cost_of, linearised, lambda state, step: state.moved(step))
        return minimise(descent, start, max_steps=max_steps, tolerance=tolerance)
    except RanAway:
        size = start.layout.size
        return Solution(start, NormalEquations(np.eye(size), np.zeros(size), np.inf), Outcome.STALLED, 0)


def cost(task: FitTask, motion: Motion) -> float:
    """What the outlines cost under a motion; infinite where it cannot be flown."""
    try:
        return data_cost(task, errors_of(task, motion.first, flown_in(motion, task.sightings)))
    except RanAway:
        return np.inf


def data_cost(task: FitTask, errors: TangencyErrors) -> float:
    """Cost scaled up for pairs without tangent planes, so that losing pairs never pays."""
    wanted = np.count_nonzero(task.weight)
    valid = np.count_nonzero(errors.valid)
    return float(errors.cost.sum()) * wanted / valid if valid else np.inf


def equations(task: FitTask, motion: Motion) -> NormalEquations:
    """Normal equations of that cost."""
    predicted, sensitivity = sensitivity_in(motion, task.sightings)
    errors, S = errors_of(task, motion.first, predicted), pose_map(sensitivity)
    H = np.einsum("nap,nab,nbq->pq", S, errors.normal, S, optimize=True)
    return NormalEquations(H, np.einsum("nap,na->p", S, errors.gradient), data_cost(task, errors))
