"""Levenberg-Marquardt on normal equations over any state that can be moved by a step.

Marquardt's diagonal scaling with Nielsen's damping update [Marquardt 1963; Madsen, Nielsen & Tingleff 2004, alg. 3.16]. A linearisation
costs more than a cost, so steps are tried on the cost alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
State = TypeVar("State")


class Outcome(StrEnum):
    """How an optimisation ended."""

    CONVERGED = "converged"
    STALLED = "no step lowers the cost"
    MAX_STEPS = "step limit reached"


@dataclass(frozen=True)
class NormalEquations:
    """``H`` (p, p), ``g`` (p,) and ``cost`` of a linearised least-squares problem: cost + gᵀd + dᵀHd/2."""

    H: Array
    g: Array
    cost: float


@dataclass(frozen=True)
class Descent(Generic[State]):
    """What is minimised: the cost of a state, its linearisation, and how a step moves a state."""

    cost: Callable[[State], float]
    linearise: Callable[[State], NormalEquations]
    move: Callable[[State, Array], State]


@dataclass(frozen=True)
class Solution(Generic[State]):
    """The best state, its last linearisation, how it ended, and how many steps were taken."""

    state: State
    equations: NormalEquations
    outcome: Outcome
    steps: int


def minimise(problem: Descent[State], start: State, *, max_steps: int = 40, tolerance: float = 1e-7) -> Solution[State]:
    """Minimise from ``start`` until the predicted fall of the cost is below ``tolerance`` (relative)."""
    state = start
    equations = problem.linearise(state)
    damping, growth = 1e-4, 2.0
    for step_number in range(max_steps):
        step = solve_damped(equations, damping)
        predicted = -float(equations.g @ step) - 0.5 * float(step @ equations.H @ step)
        if predicted <= tolerance * max(equations.cost, 1e-300):
            return Solution(state, equations, _ending(equations, tolerance), step_number)
        trial = problem.move(state, step)
        gain = (equations.cost - problem.cost(trial)) / predicted
        if gain > 0.0:
            state = trial
            equations = problem.linearise(state)
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3) if gain < 0.9 else 0.1
            damping, growth = max(damping, 1e-12), 2.0
        else:
            damping *= growth
            growth *= 2.0
            if damping > 1e12:
                return Solution(state, equations, Outcome.STALLED, step_number)
    return Solution(state, equations, Outcome.MAX_STEPS, max_steps)


def _ending(equations: NormalEquations, tolerance: float) -> Outcome:
    """Converged where the undamped step promises no more either; stalled where only damping made the promise small."""
    step = solve_damped(equations, 1e-12)
    promised = -0.5 * float(equations.g @ step)
    return Outcome.CONVERGED if promised <= STALLED_SHARE + tolerance * max(equations.cost, 1e-300) else Outcome.STALLED


STALLED_SHARE = 0.5
"""Fall of the cost, in units of log-likelihood, that is not worth a complaint: tangencies that change places leave such corners."""


def solve_damped(equations: NormalEquations, damping: float) -> Array:
    """``-(H + damping diag H)⁻¹ g``, scaled to unit diagonal first: parameters have units far apart."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(equations.H), 1e-300))
    H = equations.H * scale[:, None] * scale[None, :]
    return np.asarray(-scale * np.linalg.solve(H + damping * np.eye(len(H)), equations.g * scale))
