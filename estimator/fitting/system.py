"""A problem linearised at a state: what each part tells of its parameters, what is known of those that parts share, and what follows.

The normal matrix is a block arrow: what is one part's alone touches what is another's only through what both share. To eliminate it costs
the same for every part, so a step is linear in their number [Triggs et al. 2000, section 6]. Where parts have nothing alone, as in tangent
fits, nothing is eliminated.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.stable_inverse import LEAST_SEEN, inverse_of_all, stable_inverse

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Told(Protocol):
    """Normal equations of a part's c parameters: ``H`` (c, c) and ``g`` (c,)."""

    @property
    def H(self) -> Array:
        """Normal matrix (c, c)."""

    @property
    def g(self) -> Array:
        """Gradient (c,)."""


T_co = TypeVar("T_co", bound=Told, covariant=True)


@dataclass(frozen=True)
class Arrangement:
    """Where the parameters of parts lie among all p: first what is one part's alone, part by part, then what parts share.

    ``places`` (c,) of each part; ``local`` (l,): the columns of every part that are its own.
    """

    places: tuple[Index, ...]
    p: int
    local: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @cached_property
    def first(self) -> int:
        """Where shared parameters begin."""
        return len(self.places) * len(self.local)

    @property
    def size(self) -> int:
        """Number of shared parameters."""
        return self.p - self.first

    @cached_property
    def shared(self) -> Index:
        """Columns (c - l,) of every part that are not its own alone; all parts have as many where any are."""
        return np.delete(np.arange(len(self.places[0])), self.local)

    @cached_property
    def place(self) -> tuple[Index, ...]:
        """Where those lie among the shared parameters."""
        return tuple(np.delete(place, self.local) - self.first for place in self.places)


@dataclass(frozen=True)
class Reduced:
    """Normal equations ``H`` (s, s) and ``g`` (s,) of the shared parameters, and what is each part's alone where these are given.

    ``answer`` (n, l, c - l): how it follows the part's shared columns, ``alone`` (n, l) where they stay, and its ``variance`` (n, l) there.
    """

    H: Array
    g: Array
    answer: Array
    alone: Array
    variance: Array


@dataclass(frozen=True)
class Solution:
    """A Gauss-Newton ``step`` (p,), the ``variance`` (p,) to compare it with, and the covariance of the ``shared`` (s, s) parameters.

    The variance of what is one part's alone is that where all that is shared is known.
    """

    step: Array
    variance: Array
    shared: Array

    @property
    def size(self) -> float:
        """Largest step over its standard deviation; parameters that are not seen do not count."""
        seen = self.variance > 0.0
        return float(np.max(np.abs(self.step[seen]) / np.sqrt(self.variance[seen]), initial=0.0))


@dataclass(frozen=True)
class System(Generic[T_co]):
    """What is ``told`` by each part, whose parameters lie ``at`` their places, what is ``known`` of the shared ones, and what all costs."""

    told: tuple[T_co, ...]
    at: Arrangement
    known: NormalEquations
    cost: float

    def added(self, of_parts: Iterable[Array]) -> Array:
        """What is known and matrices ``of_parts`` (c, c) in their places: (p, p)."""
        total, first = np.zeros((self.at.p, self.at.p)), self.at.first
        total[first:, first:] = self.known.H
        for place, each in zip(self.at.places, of_parts, strict=True):
            total[np.ix_(place, place)] += each
        return total

    @cached_property
    def H(self) -> Array:
        """Normal matrix (p, p) of all parameters."""
        return self.added(each.H for each in self.told)

    @cached_property
    def g(self) -> Array:
        """Gradient (p,)."""
        total = np.concatenate([np.zeros(self.at.first), self.known.g])
        for place, each in zip(self.at.places, self.told, strict=True):
            total[place] += each.g
        return total

    def sandwich(self, noise: Array) -> Array:
        """Covariance (p, p) where the gradient's is ``noise`` (p, p)."""
        inverse = inverse_of_all(self.H)
        covariance = inverse @ noise @ inverse
        return np.asarray(0.5 * (covariance + covariance.T))

    def reduced(self, damping: float = 0.0) -> Reduced:
        """The normal equations without what is one part's alone.

        ``damping``: of every part's normal matrix so much of its diagonal is added to it [Marquardt 1963].
        """
        own, others, H, g = self.at.local, self.at.shared, self.known.H.copy(), self.known.g.copy()
        full, gradients = _damped(np.stack([each.H for each in self.told]), damping), np.stack([each.g for each in self.told])[..., None]
        inverses, cross = stable_inverse(full[:, own[:, None], own]), full[:, own[:, None], others]
        answer, alone = -inverses @ cross, -inverses @ gradients[:, own]
        left = full[:, others[:, None], others] + np.swapaxes(cross, 1, 2) @ answer
        pull = gradients[:, others] + np.swapaxes(cross, 1, 2) @ alone
        for of_one, pull_of_one, place in zip(left, pull, self.at.place, strict=True):
            H[np.ix_(place, place)] += of_one
            g[place] += pull_of_one[:, 0]
        return Reduced(H, g, answer, alone[..., 0], np.diagonal(inverses, axis1=1, axis2=2))

    def solved(self, damping: float = 0.0) -> Solution:
        """Eliminate what is one part's alone, solve for what parts share, substitute back; ``damping`` as in :meth:`reduced`."""
        if not len(self.at.local):
            inverse = stable_inverse(_damped(self.H, damping), LEAST_SEEN)
            return Solution(-inverse @ self.g, np.diag(inverse), inverse)
        reduced = self.reduced(damping)
        inverse = stable_inverse(reduced.H)
        shared = -inverse @ reduced.g
        there = np.stack([shared[place] for place in self.at.place])[..., None]
        step = np.concatenate([(reduced.alone + (reduced.answer @ there)[..., 0]).ravel(), shared])
        return Solution(step, np.concatenate([reduced.variance.ravel(), np.diag(inverse)]), inverse)


def _damped(H: Array, damping: float) -> Array:
    """Normal matrices (..., c, c) with so much of their diagonals added."""
    return H + damping * H * np.eye(H.shape[-1]) if damping > 0.0 else H
