"""Facts: what a user states of the parameters of effects, measured with other instruments than the campaign.

A fact is one linear measurement ``weightsᵀ theta = value ± sigma`` of amplitudes of effects [Bishop 2006, sec. 2.3.3]. It is one more row
of the least-squares problem, ``((weightsᵀ theta - value) / sigma)²``, in the fit as in the evidence: where its effects are not in the
model, ``theta`` is zero, and its misfit ``(value / sigma)²`` stays. Valid for what is linear over ``sigma``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model
from estimator.fitting.system import Arrangement

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


def length_fact(sigma: float) -> Fact:
    """What a calibration says of lengths: right within a standard deviation ``sigma`` of their scale."""
    return Fact(f"sigma_length_scale = {sigma:g}", (("length_scale", (1.0,)),), 0.0, sigma)


def stated_rows(facts: tuple[Fact, ...], model: Model, layout: Arrangement) -> tuple[Array, Array]:
    """Rows (r, p) and right-hand side (r,) of facts about the p shared parameters of a model, over their standard deviations.

    A fact about an effect that several particles have values of holds for each of them. One about no effect of the model has no row.
    """
    found: dict[tuple[float, ...], float] = {}
    for fact in facts:
        weights = np.zeros(model.layout.size)
        for key, each in fact.weights:
            if key in model.keys:
                weights[model.layout[key]] = each
        for place in layout.place if weights.any() else ():
            row = np.zeros(layout.size)
            row[place] = weights[layout.shared] / fact.sigma
            found[(*row.tolist(), fact.value / fact.sigma)] = fact.value / fact.sigma
    rows = np.array([key[:-1] for key in found]).reshape(len(found), layout.size)
    return rows, np.array(list(found.values()))
