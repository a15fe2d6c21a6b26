"""Parameters by name: blocks, each with what shares it, its step for difference quotients and what is known of it, and where they lie.

A prior is about zero: rotations, deviations of the body and whatever else has one are stated as increments or deviations.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Block:
    """Parameters of one ``name``, each with a label that says its unit.

    ``step`` (c,) of central differences, 0 where poses do not depend on them; ``precision`` (c,): information of the prior.
    ``scope``: whose they are, where there are several sequences.
    """

    name: str
    labels: tuple[str, ...]
    step: Array | float = 0.0
    precision: Array | float = 0.0
    scope: Scope = Scope.SEQUENCE


@dataclass(frozen=True)
class Layout:
    """Blocks one after the other: p parameters."""

    blocks: tuple[Block, ...]

    def __getitem__(self, name: str) -> slice:
        return self.places[name]

    @cached_property
    def places(self) -> dict[str, slice]:
        """Where each block lies."""
        ends = np.cumsum([0, *(len(block.labels) for block in self.blocks)]).tolist()
        return {block.name: slice(*ends[k : k + 2]) for k, block in enumerate(self.blocks)}

    @property
    def names(self) -> tuple[str, ...]:
        """Of the blocks."""
        return tuple(block.name for block in self.blocks)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Of the p parameters."""
        return tuple(label for block in self.blocks for label in block.labels)

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.labels)

    @cached_property
    def steps(self) -> Array:
        """Steps (p,) of central differences."""
        return np.concatenate([np.broadcast_to(block.step, len(block.labels)) for block in self.blocks])

    @cached_property
    def precision(self) -> Array:
        """Diagonal (p,) of the priors' information."""
        return np.concatenate([np.broadcast_to(block.precision, len(block.labels)) for block in self.blocks])

    @cached_property
    def scopes(self) -> tuple[Scope, ...]:
        """Whose each of the p parameters is."""
        return tuple(block.scope for block in self.blocks for _ in block.labels)

    def columns(self, names: Iterable[str]) -> Index:
        """Where the parameters (c,) of some blocks lie."""
        return np.concatenate([np.arange(self.size)[self[name]] for name in names])

    def of(self, scope: Scope) -> Index:
        """Where the parameters (c,) of a scope lie."""
        return self.columns(block.name for block in self.blocks if block.scope is scope)

    def held(self, known: Mapping[str, Array | float]) -> "Layout":
        """With what is ``known`` (c,) of some blocks as their precision."""
        return Layout(tuple(replace(block, precision=known.get(block.name, block.precision)) for block in self.blocks))


class State(Protocol):
    """Values of blocks."""

    @property
    def layout(self) -> Layout:
        """Where they lie."""

    @property
    def values(self) -> Array:
        """Of all p parameters (p,)."""

    def moved(self, step: Array) -> Self:
        """After a parameter step (p,)."""
