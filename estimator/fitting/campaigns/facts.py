"""Facts: what a user states of the parameters of effects, measured with other instruments than the campaign.

A fact is one linear measurement ``weightsᵀ theta = value ± sigma`` of amplitudes of effects [Bishop 2006, sec. 2.3.3]. It is one more row
of the least-squares problem, ``((weightsᵀ theta - value) / sigma)²``, in the fit as in the evidence: where its effects are not in the
model, ``theta`` is zero, and its misfit ``(value / sigma)²`` stays. Valid for what is linear over ``sigma``.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model
from estimator.motion.flight import N_PARAMETERS

if TYPE_CHECKING:
    from estimator.fitting.campaigns.campaign import Layout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fact:
    """One stated number.

    Attributes
    ----------
    words : str
        As the user wrote it.
    weights : tuple of (str, tuple of float)
        Of every effect that it is about, the key and the weight of each of its q parameters.
    value, sigma : float
        What the weighted sum is, and its standard deviation, more than 0.
    """

    words: str
    weights: tuple[tuple[str, tuple[float, ...]], ...]
    value: float
    sigma: float

    @property
    def effects(self) -> tuple[str, ...]:
        """Keys of the effects that it is about."""
        return tuple(key for key, _ in self.weights)

    @property
    def surprise(self) -> float:
        """Standard deviations by which it misses a model without its effects."""
        return abs(self.value) / self.sigma


def stated_rows(facts: tuple[Fact, ...], model: Model, layout: "Layout") -> tuple[Array, Array]:
    """Rows (r, p) and right-hand side (r,) of facts about the p shared parameters of a model, over their standard deviations.

    A fact about an effect that several particles have values of holds for each of them. One about no effect of the model has no row.
    """
    found: dict[tuple[float, ...], float] = {}
    column = {int(c): i for i, c in enumerate(layout.shared)}
    for fact in facts:
        local = _columns(fact, model)
        for place in layout.place if local else ():
            row = np.zeros(layout.size)
            for c, weight in local.items():
                row[place[column[c]]] += weight / fact.sigma
            found[(*row.tolist(), fact.value / fact.sigma)] = fact.value / fact.sigma
    rows = np.array([key[:-1] for key in found]).reshape(len(found), layout.size)
    return rows, np.array(list(found.values()))


def _columns(fact: Fact, model: Model) -> dict[int, float]:
    """Columns of a sequence's 21 + q that a fact is about, with their weights."""
    found: dict[int, float] = {}
    for key, weights in fact.weights:
        if key in model.keys:
            part = model.slices[model.keys.index(key)]
            found.update({N_PARAMETERS + part.start + i: w for i, w in enumerate(weights) if w})
    return found
