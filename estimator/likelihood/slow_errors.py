"""How large the slow errors of a tracker are (:mod:`estimator.effects.instrument.slow_errors`).

That is read off what residuals say of their curves beside all that a flight has for itself, by the likelihood that fits have.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

Array = NDArray[np.float64]
SIZES = np.geomspace(0.1, 100.0, 25)
"""What the slowest curve of the longest flight may be, over the noise of a row: below it nothing is seen. Effort alone."""
SEEN = 1e-9
"""Of the information on curves alone, from which on they are seen beside all else: rounding."""


@dataclass(frozen=True)
class Told:
    """What a flight says of its curves' amplitudes along an axis: ``information`` (k,) of each, and ``pull`` (k,), beside all else."""

    information: Array
    pull: Array

    @classmethod
    def of(cls, information: Array, pull: Array, alone: float) -> "Told":
        """By the whole ``information`` (k, k) and ``pull`` (k,), in whose own axes amplitudes are independent of one another.

        ``alone``: information on the best seen curve, if nothing else were unknown.
        """
        w, V = np.linalg.eigh(information)
        seen = w > SEEN * alone
        return cls(w[seen], (V.T @ pull)[seen])

    def log_likelihood(self, size: Array) -> Array:
        """Of each ``size`` (n,) m/s^1.5 of the process, over that of none (nats)."""
        gain = np.outer(size**2, self.information)
        return np.asarray(np.sum(0.5 * self.pull**2 / self.information * gain / (1.0 + gain) - 0.5 * np.log1p(gain), axis=1))


def size_of(told: Sequence[Told], unit: float) -> tuple[float, float]:
    """Size (m/s^1.5) of the process by what flights say, the mean of its logarithm, and the evidence for it over that for none (nats).

    ``unit`` (m/s^1.5): size that makes the slowest curve of the longest flight as large as the noise of a row.
    """
    value = np.sum([np.zeros(len(SIZES)), *(each.log_likelihood(unit * SIZES) for each in told)], axis=0)
    return float(unit * np.exp(softmax(value) @ np.log(SIZES))), float(logsumexp(value) - np.log(len(SIZES)))
