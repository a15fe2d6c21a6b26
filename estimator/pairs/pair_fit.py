"""The joint fit of two flights that collide: each has its poses, velocities and body, and both share the time of the impact.

A problem of two parts (:mod:`estimator.fitting.problem`), whose outlines and calibrated views are different ones: the blocks of the pair
are those of the first flight and, apart from the time, those of the second.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import FitTask
from estimator.fitting.problem import Part
from estimator.fitting.refinement import Solved
from estimator.fitting.system import Index
from estimator.motion.blocks import Layout
from estimator.motion.piecewise import TIME, PiecewiseFlight, named

Array = NDArray[np.float64]
SHARED = named(TIME, 0)
"""The block that both flights have: when they meet."""


@dataclass(frozen=True)
class PairFlight:
    """Two flights with one impact each, at one time."""

    first: PiecewiseFlight
    second: PiecewiseFlight

    @property
    def both(self) -> tuple[PiecewiseFlight, PiecewiseFlight]:
        """The two."""
        return self.first, self.second

    @cached_property
    def layout(self) -> Layout:
        """All blocks of the first, then those of the second that it has for itself."""
        second = [replace(block, name=of_second(block.name)) for block in self.second.layout.blocks]
        return Layout((*self.first.layout.blocks, *(block for block in second if block.name != SHARED)))

    @cached_property
    def places(self) -> tuple[Index, Index]:
        """Where the parameters of each flight lie."""
        first, second = (flight.layout.names for flight in self.both)
        return self.layout.columns(first), self.layout.columns(of_second(name) for name in second)

    @property
    def values(self) -> Array:
        """Of all parameters (p,)."""
        values = np.zeros(self.layout.size)
        for place, flight in zip(self.places, self.both, strict=True):
            values[place] = flight.values
        return values

    def moved(self, step: Array) -> "PairFlight":
        """The pair after a parameter step (p,)."""
        first, second = (flight.moved(step[place]) for flight, place in zip(self.both, self.places, strict=True))
        return PairFlight(first, second)


PairRefined = Solved[PairFlight, PiecewiseFlight]


def of_second(name: str) -> str:
    """The pair's name of a block of the second flight."""
    return name if name == SHARED else f"second_{name}"


def at_one_time(first: PiecewiseFlight, second: PiecewiseFlight, shares: tuple[float, float]) -> PairFlight:
    """Two flights with their impacts moved to the mean of both times, weighed by ``shares``."""
    time_s = float(np.average([first.bounces[0].time_s, second.bounces[0].time_s], weights=shares))
    moved = [replace(f, bounces=(replace(f.bounces[0], time_s=time_s),)) for f in (first, second)]
    return PairFlight(moved[0], moved[1])


def parts_of(tasks: Sequence[FitTask], pair: PairFlight) -> tuple[Part[PairFlight, PiecewiseFlight], ...]:
    """The outlines of both."""
    return (
        Part(tasks[0], lambda state: state.first, pair.places[0]),
        Part(tasks[1], lambda state: state.second, pair.places[1]),
    )
