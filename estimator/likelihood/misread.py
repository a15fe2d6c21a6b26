"""Which readings of a spin are of another flight: how that flight is lifted has nothing to do with what was read.

The lift ``W x v`` of a flight is that of the spin that was read, ``W = C omega / (1 + l |omega| / |v|)`` beside a normal scatter, or it is
that of another spin: normal about none, whatever was read [a mixture of right and wrong ones, as in Torr and Zisserman 2000]. About the
lift by a reading of the wrong sign, or of another ball, no scatter would be a small one, and it would pull ``C`` and ``l`` to itself.
All that is not known of lifts and of readings, few flights do not tell: it is summed over.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MEDIAN_OF_TWO = 2.0 * float(np.log(2.0))
"""Median of chi-squared with two degrees of freedom."""
LIFTS = np.linspace(-4.0, 4.0, 81)
"""``C``, over what makes lifts by readings as large as lifts are; of either sign."""
SATURATION = np.array([0.0, 0.3, 1.0, 3.0, 10.0])
"""By how much a usual reading's lift is smaller than without saturation: ``l |omega| / |v|`` in the median."""
ABOUT_RIGHT, OF_WRONG = np.geomspace(1.0 / 16.0, 0.5, 4), np.array([0.5, 1.0, 2.0])
"""Scatter of lifts about those by right readings, which tell most of a lift or are not right, and of lifts by wrong ones, which are such as
lifts are; over what those are in the median."""
RIGHT = np.array([0.5, 0.6, 0.7, 0.8, 0.9, 0.96, 0.99])
"""Shares of right readings: most are, or nothing says which."""


@dataclass(frozen=True)
class Lifts:
    """Of n flights, what lies across each: the lift ``shown`` (n, 2) 1/s, its ``covariance`` (n, 2, 2), the spin ``read`` (n, 2) rad/s.

    ``spin_per_speed`` (n,) 1/m: size of the whole reading over the speed.
    """

    shown: Array
    covariance: Array
    read: Array
    spin_per_speed: Array

    @property
    def size(self) -> float:
        """How large (1/s) a component usually is."""
        return float(np.sqrt(np.median(np.sum(self.shown**2, axis=1)) / MEDIAN_OF_TWO))

    def beside(self, expected: Array, scatter: float) -> Array:
        """Log density (..., n) of the lifts about ``expected`` ones (..., n, 2) 1/s, of a ``scatter`` (1/s)."""
        C = self.covariance + scatter**2 * np.eye(2)
        off, inverse = self.shown - expected, np.linalg.inv(C)
        return np.asarray(-0.5 * (np.einsum("...ni,nij,...nj->...n", off, inverse, off) + np.linalg.slogdet(C)[1]))


def probably_misread(lifts: Lifts) -> Array:
    """Probability (n,) of each reading to be of another flight."""
    size, usual = lifts.size, float(np.median(lifts.spin_per_speed))
    if not size > 0.0 or not usual > 0.0:  # nothing is lifted, or nothing was read
        return np.zeros(len(lifts.shown))
    log_right, log_wrong = np.log(RIGHT)[:, None, None], np.log1p(-RIGHT)[:, None, None]
    others = log_wrong + np.array([lifts.beside(np.zeros(2), scatter * size) for scatter in OF_WRONG])
    each = []
    for saturation, scatter in product(SATURATION, ABOUT_RIGHT):
        law = lifts.read / (1.0 + saturation * lifts.spin_per_speed / usual)[:, None]
        expected = LIFTS[:, None, None] * law * size / np.sqrt(np.mean(law**2))
        right = log_right + lifts.beside(expected, scatter * size)[:, None, None]
        each.append(_summed(right, others))
    density = np.array([log_density for log_density, _ in each])
    weight = np.exp(density - density.max())
    return np.asarray(weight @ np.array([misread for _, misread in each]) / weight.sum())


def _summed(right: Array, wrong: Array) -> tuple[float, Array]:
    """Log of the density of all n lifts summed over what stands before the last axis of log densities, and readings' share (n,) of wrong.

    ``right`` and ``wrong`` (..., n): with the logarithm of how probable a reading is to be that.
    """
    either = np.logaddexp(right, wrong)
    density = either.sum(axis=-1)
    weight = np.exp(density - density.max())
    misread = np.exp(wrong - either).reshape(density.size, -1)
    return float(density.max() + np.log(weight.sum())), np.average(misread, axis=0, weights=weight.ravel())
