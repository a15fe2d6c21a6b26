"""A problem: blocks of parameters, and what outlines, facts and priors say of them together.

A *state* holds the values of all blocks: a free flight, one before a camera of unknown focal length, flights that meet at impacts, or
two of those that collide. Every *part* of a problem is one particle's outlines, which bear on one motion of the state; *facts* bear on
all of it. Of each the normal equations are added up where its blocks lie, so blocks that parts share need nothing more.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import FitTask
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.system import Arrangement, Index, System
from estimator.motion.blocks import State
from estimator.motion.flight import Motion

Array = NDArray[np.float64]

S = TypeVar("S", bound=State)
M = TypeVar("M", bound=Motion)
M_co = TypeVar("M_co", bound=Motion, covariant=True)
T = TypeVar("T", bound=NormalEquations)
Fact = Callable[[S], NormalEquations]
"""What is known of all p parameters besides outlines and priors; in a covariance it counts like a prior."""


@dataclass(frozen=True)
class Part(Generic[S, M_co]):
    """One particle's outlines, which moves as ``motion`` of a state says; ``place`` (c,): where its parameters lie among all."""

    task: FitTask
    motion: Callable[[S], M_co]
    place: Index


def alone(task: FitTask, motion: M) -> tuple[Part[M, M]]:
    """The parts of a problem whose state is one motion."""
    return (Part(task, lambda state: state, np.arange(motion.layout.size)),)


@dataclass(frozen=True)
class Problem(Generic[S, M, T]):
    """Parts, what ``linearise`` makes of the outlines of each under a motion, and facts."""

    parts: tuple[Part[S, M], ...]
    linearise: Callable[[FitTask, M], T]
    facts: tuple[Fact[S], ...] = ()

    def at(self, state: S) -> System[T]:
        """The problem linearised at a state."""
        known = with_facts(prior_of(self.parts, state), self.facts, state)
        told = tuple(self.linearise(part.task, part.motion(state)) for part in self.parts)
        at = Arrangement(tuple(part.place for part in self.parts), state.layout.size)
        return System(told, at, known, known.cost + sum(each.cost for each in told))


def prior_of(parts: Sequence[Part[S, M]], state: S) -> NormalEquations:
    """What is known of the parameters beforehand: that they are about zero."""
    precision, values = np.zeros(state.layout.size), state.values
    for part in parts:
        precision[part.place] = part.motion(state).layout.held(part.task.prior.known).precision
    return prior_equations(precision, values)


def prior_equations(precision: Array, values: Array) -> NormalEquations:
    """That ``values`` (p,) are about zero, with a ``precision`` (p,)."""
    return NormalEquations(np.diag(precision), precision * values, 0.5 * float(values @ (precision * values)))


def with_facts(known: NormalEquations, facts: Sequence[Fact[S]], state: S) -> NormalEquations:
    """What is ``known`` of a state, with what facts say of it."""
    for fact in facts:
        more = fact(state)
        known = NormalEquations(known.H + more.H, known.g + more.g, known.cost + more.cost)
    return known


def with_more(told: T, known: NormalEquations) -> System[T]:
    """What outlines told of more parameters than those of which something is known."""
    size = len(told.g)
    more = (0, size - len(known.g))
    known = NormalEquations(np.pad(known.H, more), np.pad(known.g, more), known.cost)
    return System((told,), Arrangement((np.arange(size),), size), known, known.cost + told.cost)
