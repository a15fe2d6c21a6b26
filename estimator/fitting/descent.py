"""Steps from a state to where all that a problem says agrees, each no longer than what lowers the cost.

Gauss-Newton with step halving, the weights refreshed at every step. What a step costs is known before it is linearised, and only a step
that is taken is.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, repeat
from operator import mul
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.system import Solution, System, Told
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
S = TypeVar("S")
T = TypeVar("T", bound=Told)
T_co = TypeVar("T_co", bound=Told, covariant=True)
MOST_STEPS, HALVINGS, SHORTER, SETTLED = 15, 5, 0.3, 0.05
"""Steps of a fit; shares of a step that are tried, each the fraction ``SHORTER`` of the one before; a step below ``SETTLED`` standard
deviations ends it. By judgement."""
STILL, STILL_COST, STILL_SHARE = 0.35, 0.1, 1e-4
"""A fit also ends where a step below ``STILL`` standard deviations changes the cost by less than ``STILL_COST``, a small fraction of what
tells models apart, or than ``STILL_SHARE`` of it: tangents that jump from corner to corner keep large misfits from settling further
(notebook 27)."""
PATIENCE = 3
"""Steps that lower the cost by less than ``STILL_SHARE`` of it before a fit is given up where it was best: large misfits wander.

See notebook 26."""
FALLING, MOST_FALLING = 0.01, 40
"""A fit whose last step lowered the cost by more than the share ``FALLING`` of it goes on beyond its steps, up to ``MOST_FALLING``.

See notebook 33."""


class Costed(Protocol[S, T_co]):
    """A problem that knows what a state costs."""

    def moved(self, state: S, step: Array) -> S:
        """The state after a ``step`` (p,) of all parameters."""

    def tried(self, state: S, most: float) -> Callable[[], System[T_co]] | None:
        """What linearises the problem at a state; ``None`` where that costs more than ``most``."""


@dataclass(frozen=True)
class Effort:
    """How far a descent goes.

    ``steps``: after which one ends that no longer falls fast (:data:`FALLING`); one that does ends after ``falling``.
    ``dampings``: tried in turn where a whole step raises the cost, in place of shares of it; the next step begins at the one before that
    which served [Marquardt, J. SIAM 11 (1963) 431].
    """

    steps: int = MOST_STEPS
    falling: int = MOST_FALLING
    dampings: Sequence[float] = ()


USUAL = Effort()


@dataclass(frozen=True)
class Descended(Generic[S, T]):
    """The ``state`` at the end, the problem linearised there, and whether the steps ``settled``."""

    state: S
    system: System[T]
    settled: bool


def descended(problem: Costed[S, T], start: S, effort: Effort = USUAL) -> Descended[S, T]:
    """Steps until they are small, or until :data:`PATIENCE` of them in a row gain nothing; then the best of what was seen.

    Raises
    ------
    RanAway
        Where ``start`` cannot be flown, or nothing is seen of it.
    """
    begun = problem.tried(start, np.finfo(float).max)
    if begun is None:
        raise RanAway("nothing is seen of the flights that a fit starts from")
    now = least = Descended(start, begun(), False)
    mark, in_vain, falls, damping = now.system.cost, 0, False, 0
    for count in range(max(effort.steps, effort.falling)):
        if count >= effort.steps and not falls:
            break
        before, solution = now.system.cost, now.system.solved()
        lower = _lower(problem, now, _steps(now.system, solution, effort.dampings, damping))
        if lower is None:
            break
        (now, tried), cost = lower, lower[0].system.cost
        damping = max(damping + tried - 1, 0)
        still = solution.size < SETTLED or (solution.size < STILL and abs(before - cost) < max(STILL_COST, STILL_SHARE * before))
        if still and now.settled:
            return now
        falls = cost < before * (1.0 - FALLING)
        mark, in_vain = (cost, 0) if cost < mark * (1.0 - STILL_SHARE) else (mark, in_vain + 1)
        least = min(least, now, key=lambda each: each.system.cost)
        if in_vain == PATIENCE:
            break
    return Descended(least.state, least.system, False)


def _lower(problem: Costed[S, T], at: Descended[S, T], steps: Iterator[tuple[Array, bool]]) -> tuple[Descended[S, T], int] | None:
    """After the first of ``steps`` that does not raise the cost, and its number; one that is not whole does not settle."""
    most = at.system.cost * (1.0 + STILL_SHARE)
    for number, (step, settles) in enumerate(steps):
        state = problem.moved(at.state, step)
        try:
            linearised = problem.tried(state, most)
        except RanAway:
            continue
        if linearised is not None:
            return Descended(state, linearised(), settles), number
    return None


def _steps(system: System[T], solution: Solution, dampings: Sequence[float], first: int) -> Iterator[tuple[Array, bool]]:
    """Steps (p,), and whether they are not damped: ever shorter ones, or from the ``first`` on the whole one and ever more damped ones."""
    if not dampings:
        yield from ((share * solution.step, True) for share in accumulate(repeat(SHORTER, HALVINGS - 1), mul, initial=1.0))
    elif not first:
        yield solution.step, True
    yield from ((system.solved(damping).step, False) for damping in dampings[max(first - 1, 0) :])
