"""The last refinement: Gauss-Newton steps with refreshed weights to where a problem's factors agree, and how sure that is.

One loop and one covariance for every problem: a free flight, with the focal length or without, flights that meet at impacts, two that
collide.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import flown_in, unbiased_errors
from estimator.data.fit_task import FitTask, Sightings
from estimator.fitting.focal_flight import at_focal
from estimator.fitting.problem import Fact, M, M_co, Part, Problem, S, T, alone
from estimator.fitting.stable_inverse import determined, scaled_inverse
from estimator.fitting.system import System
from estimator.fitting.weighed_tangencies import Linearised, Refinement, linearise
from estimator.likelihood.noise_model import MeasuredNoise, measured_noise, with_noise
from estimator.motion.blocks import State
from estimator.motion.flight import Motion
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
MOST_STEPS, FINE_STEPS = 24, 8
"""Steps of the last refinement, and those after which a coarser end is enough (below)."""
SETTLED, STEADY = 0.1, 0.3
"""Shares of the standard deviations: a smaller step ends the refinement; tangencies that change places may leave steps up to the second.

So after ``FINE_STEPS`` steps the second is enough. A first fit in other weights may be ten standard deviations off, and takes more steps.
"""
S_co = TypeVar("S_co", bound=State, covariant=True)


def no_drift(time_s: float, segment: int, omega: Array) -> Array:
    """Nothing (6, 6) at a ``time_s`` of any ``segment``, whatever the angular velocity ``omega`` (3,) rad/s, world frame."""
    del time_s, segment, omega
    return np.zeros((6, 6))


@dataclass(frozen=True)
class Refined(Generic[M_co]):
    """A refined motion, ``covariance``, ``bound`` and ``inverse`` of the normal matrix (p, p) of its parameters, whether the steps settled.

    ``at``: its outlines' errors with the ``noise`` found. ``drift``: what the covariance (6, 6) of velocities at a time (s), after so many
    impacts and with an angular velocity (3,), has beside that of the parameters.
    """

    flight: M_co
    covariance: Array
    bound: Array
    inverse: Array
    at: Linearised
    settled: bool
    noise: MeasuredNoise
    drift: Callable[[float, int, Array], Array] = no_drift

    @property
    def sightings(self) -> Sightings:
        """That were fitted."""
        return self.at.task.sightings


@dataclass(frozen=True)
class Solved(Generic[S_co, M_co]):
    """The ``state`` at the end with the ``covariance`` (p, p) of its parameters, and each part of its own."""

    state: S_co
    covariance: Array
    parts: tuple[Refined[M_co], ...]


def refine(task: FitTask, motion: M, settings: Refinement, facts: Sequence[Fact[M]] = ()) -> Refined[M]:
    """One particle's motion, from one that fits."""
    return solve(alone(task, motion), motion, settings, facts).parts[0]


def solve(parts: Sequence[Part[S, M]], state: S, settings: Refinement, facts: Sequence[Fact[S]] = ()) -> Solved[S, M]:
    """The state where outlines, facts and priors agree, with the noise that the outlines show where it begins."""
    noisy, noises = zip(*(_with_noise_of(part, state) for part in parts), strict=True)
    problem: Problem[S, M, Linearised] = Problem(noisy, partial(linearise, settings=settings), tuple(facts))
    state, system, settled = stepped(problem, state)
    covariance, bound = spread(system)
    inverse, refined = system.solved().shared, []
    for part, at, noise in zip(parts, system.told, noises, strict=True):
        own = np.ix_(part.place, part.place)
        refined.append(Refined(part.motion(state), covariance[own], bound[own], inverse[own], at, settled, noise))
    return Solved(state, covariance, tuple(refined))


def _with_noise_of(part: Part[S, M], state: S) -> tuple[Part[S, M], MeasuredNoise]:
    task, noise = with_noise_at(part.task, part.motion(state))
    return replace(part, task=task), noise


def with_noise_at(task: FitTask, motion: Motion) -> tuple[FitTask, MeasuredNoise]:
    """The task with the noise that its errors under a motion show, and that noise."""
    noise = measured_noise(unbiased_errors(at_focal(task, motion), motion.first, flown_in(motion, task.sightings)))
    return replace(task, sightings=replace(task.sightings, silhouettes=with_noise(task.sightings.silhouettes, noise))), noise


def system_at(task: FitTask, motion: M, settings: Refinement) -> System[Linearised]:
    """What the outlines and the prior say at a motion of one particle."""
    problem: Problem[M, M, Linearised] = Problem(alone(task, motion), partial(linearise, settings=settings))
    return problem.at(motion)


def stepped(problem: Problem[S, M, T], state: S) -> tuple[S, System[T], bool]:
    """Gauss-Newton steps from a state until they are small; the last state, the problem there, and whether they became so.

    After ``FINE_STEPS`` a step that turns back from the one before is halved: weights that change from step to step can throw the state
    from one side of its end to the other for ever.
    """
    system, settled, last = problem.at(state), False, None
    for count in range(1, MOST_STEPS + 1):
        solution = system.solved()
        step = solution.step
        back = last is not None and count > FINE_STEPS and float(last @ system.H @ step) < 0.0
        last = step
        try:
            there = state.moved(0.5 * step if back else step)
            state, system = there, problem.at(there)
        except RanAway:
            settled = False
            break
        settled = solution.size < STEADY
        if solution.size < SETTLED or (settled and count >= FINE_STEPS):
            break
    return state, system, settled


def spread(system: System[Linearised]) -> tuple[Array, Array]:
    """Sandwich covariance and Cramér-Rao-type bound (p, p) each.

    Raises
    ------
    NothingSeen
        Where there is none: the sightings say nothing of some parameter, or of some combination of them.
    """
    return sandwich(system), scaled_inverse(system.added(each.information for each in system.told))


def sandwich(system: System[Linearised]) -> Array:
    """Covariance (p, p) of the parameters.

    Raises
    ------
    NothingSeen
        Where there is none.
    """
    determined(system.H)
    return system.sandwich(system.added(each.spread for each in system.told))
