"""The joint fit of two flights that collide: each has its poses, velocities and body, and both share the time of the impact.

Each flight's normal equations are those of a flight with one impact (:mod:`estimator.impacts.piecewise_fit`); the parameters of the pair
are those of the first and, apart from the time, those of the second. With ``M_k`` picking flight k's parameters from the pair's, the pair's
matrix is ``sum M_k' H_k M_k``, and so is what lies between the inverses of the sandwich covariance: the two see different outlines and
different calibrated views.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import FitTask
from estimator.fitting.levenberg_marquardt import NormalEquations, Problem, Solution, minimise
from estimator.fitting.refinement import (
    Linearised,
    Refined,
    Refinement,
    covariance_and_bound,
    determined,
    linearised,
    scaled_inverse,
    stepped,
)
from estimator.impacts.piecewise_fit import PiecewiseRefined, in_order, linearise_piecewise, piecewise_cost, with_noise_at
from estimator.likelihood.noise_model import MeasuredNoise
from estimator.motion.flight import N_PARAMETERS
from estimator.motion.piecewise import PER_IMPACT, Bounce, PiecewiseFlight, moved_piecewise, piecewise_sensitivity

Array = NDArray[np.float64]
ONE = N_PARAMETERS + PER_IMPACT
"""Parameters of a flight with one impact."""
TIME = N_PARAMETERS
PAIR = 2 * ONE - 1
"""Parameters of a pair: both flights with one impact, whose time they share."""
Two = tuple[FitTask, FitTask]
Contact = Callable[["PairFlight"], NormalEquations]
"""What is known of a pair from the contact itself, as normal equations (55, 55)."""

Seen = tuple[list[Linearised], NormalEquations]
"""The equations of both flights, and what the contact says."""


@dataclass(frozen=True)
class PairFlight:
    """Two flights with one impact each, at one time."""

    first: PiecewiseFlight
    second: PiecewiseFlight

    @property
    def both(self) -> tuple[PiecewiseFlight, PiecewiseFlight]:
        """The two."""
        return self.first, self.second


@dataclass(frozen=True)
class PairRefined:
    """The two refined flights, each with its own part of the joint ``covariance`` (p, p)."""

    first: PiecewiseRefined
    second: PiecewiseRefined
    covariance: Array

    @property
    def both(self) -> tuple[PiecewiseRefined, PiecewiseRefined]:
        """The two."""
        return self.first, self.second

    @property
    def flights(self) -> PairFlight:
        """The flights alone."""
        return PairFlight(self.first.flight, self.second.flight)


def nothing_known(_pair: PairFlight) -> NormalEquations:
    """Of the contact."""
    return NormalEquations(H=np.zeros((PAIR, PAIR)), g=np.zeros(PAIR), cost=0.0)


def parameter_maps() -> tuple[Array, Array]:
    """``M`` (28, 55) of each flight: its own parameters from the pair's."""
    first, second = np.eye(ONE, PAIR), np.zeros((ONE, PAIR))
    own = [k for k in range(ONE) if k != TIME]
    second[TIME, TIME] = 1.0
    second[own, np.arange(ONE, PAIR)] = 1.0
    return first, second


def at_one_time(first: PiecewiseFlight, second: PiecewiseFlight, shares: tuple[float, float]) -> PairFlight:
    """Two flights with their impacts moved to the mean of both times, weighed by ``shares``."""
    time_s = float(np.average([first.bounces[0].time_s, second.bounces[0].time_s], weights=shares))
    moved = [PiecewiseFlight(f.first, (Bounce(time_s, f.bounces[0].v, f.bounces[0].omega),)) for f in (first, second)]
    return PairFlight(moved[0], moved[1])


def moved_pair(pair: PairFlight, step: Array) -> PairFlight:
    """The pair after a parameter step (55,)."""
    first, second = (moved_piecewise(flight, M @ step) for flight, M in zip(pair.both, parameter_maps(), strict=True))
    return PairFlight(first, second)


def fit_pair(tasks: Two, start: PairFlight, *, max_steps: int = 25, tolerance: float = 1e-5) -> Solution[PairFlight]:
    """Levenberg-Marquardt from ``start``."""
    problem = Problem(cost=lambda pair: _cost(tasks, pair), linearise=lambda pair: _linearise(tasks, pair), move=moved_pair)
    return minimise(problem, start, max_steps=max_steps, tolerance=tolerance)


def _cost(tasks: Two, pair: PairFlight) -> float:
    return sum(piecewise_cost(task, flight) for task, flight in zip(tasks, pair.both, strict=True))


def _linearise(tasks: Two, pair: PairFlight) -> NormalEquations:
    parts = [linearise_piecewise(task, flight) for task, flight in zip(tasks, pair.both, strict=True)]
    H, g = _together([p.H for p in parts], [p.g for p in parts])
    return NormalEquations(H=H, g=g, cost=sum(p.cost for p in parts))


def _together(H: list[Array], g: list[Array]) -> tuple[Array, Array]:
    maps = parameter_maps()
    return (
        np.asarray(sum(M.T @ part @ M for M, part in zip(maps, H, strict=True))),
        np.asarray(sum(M.T @ part for M, part in zip(maps, g, strict=True))),
    )


def refine_pair(tasks: Two, pair: PairFlight, settings: Refinement, contact: Contact) -> PairRefined:
    """Gauss-Newton steps with refreshed weights until they are small, as :func:`estimator.impacts.piecewise_fit.refine_piecewise`.

    What ``contact`` says of the pair's parameters counts as known, like a prior, in the covariance.
    """
    noisy, noises = zip(*(with_noise_at(t, f) for t, f in zip(tasks, pair.both, strict=True)), strict=True)

    def seen_at(pair: PairFlight) -> Seen:
        return _both_linearised(noisy, pair, settings), contact(pair)

    def system(seen: Seen) -> tuple[Array, Array]:
        at, known = seen
        H, g = _together([a.H for a in at], [a.g for a in at])
        return H + known.H, g + known.g

    def further(pair: PairFlight, step: Array) -> tuple[PairFlight, Seen] | None:
        there = moved_pair(pair, step)
        return (there, seen_at(there)) if all(in_order(flight) for flight in there.both) else None

    pair, (at, known), settled = stepped((pair, seen_at(pair)), system, further)
    return _with_covariance(noisy, pair, (at, known.H), (noises, settled), settings)


def _both_linearised(tasks: Sequence[FitTask], pair: PairFlight, settings: Refinement) -> list[Linearised]:
    return [linearised(t, f.first, piecewise_sensitivity(f, t.sightings.times_s), settings) for t, f in zip(tasks, pair.both, strict=True)]


def _with_covariance(
    tasks: Sequence[FitTask],
    pair: PairFlight,
    found: tuple[list[Linearised], Array],
    how: tuple[Sequence[MeasuredNoise], bool],
    settings: Refinement,
) -> PairRefined:
    """The sandwich of the pair from those of the two: between the inverses lies the sum of what lies there in each."""
    (at, contact), spreads, known = found, [], []
    for task, a in zip(tasks, at, strict=True):
        prior = np.diag(np.pad(task.prior.precision, (0, ONE - N_PARAMETERS)))
        covariance, bound = covariance_and_bound(task, a, prior, settings)
        spreads.append(a.H @ covariance @ a.H)
        known.append(scaled_inverse(bound))
    nothing = [np.zeros(ONE), np.zeros(ONE)]
    inverse = scaled_inverse(determined(_together([a.H for a in at], nothing)[0] + contact))
    joint = inverse @ (_together(spreads, nothing)[0] + contact) @ inverse
    bound = scaled_inverse(_together(known, nothing)[0] + contact)
    refined = [
        _refined_part(task, flight, a, (M @ joint @ M.T, M @ bound @ M.T), (noise, how[1]))
        for task, flight, a, M, noise in zip(tasks, pair.both, at, parameter_maps(), how[0], strict=True)
    ]
    return PairRefined(refined[0], refined[1], 0.5 * (joint + joint.T))


def _refined_part(
    task: FitTask, flight: PiecewiseFlight, at: Linearised, spread: tuple[Array, Array], how: tuple[MeasuredNoise, bool]
) -> PiecewiseRefined:
    places = np.column_stack([task.sightings.camera, task.sightings.frame])
    covariance, bound = (0.5 * (matrix + matrix.T) for matrix in spread)
    refined = Refined(flight.first, at.predicted, covariance, bound, at.errors, at.frames, at.within, how[1], how[0], places)
    return PiecewiseRefined(flight, refined, task.sightings.times_s)
