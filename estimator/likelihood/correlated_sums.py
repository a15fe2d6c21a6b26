"""Covariance of sums of errors that are alike at neighbouring tangents, in a time that grows with their number, not with its square.

The correlation ``exp(-|Δθ| / l)`` of :mod:`estimator.likelihood.noise_model` is that of a Markov process along the outline: what all
tangents behind one contribute to it is what they contribute to the one before, and that one's own, both faded over the angle between the
two [Rybicki and Press, Class of fast methods for processing irregularly sampled or otherwise inhomogeneous one-dimensional data, Phys. Rev.
Lett. 74, 1995]. On the closed outline *behind* ends half a turn back.
"""

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AlongOutlines:
    """Noise of N tangents of outlines that are independent of one another.

    ``outline`` (N,) which of them a tangent is of, -1 for one that is left out; ``angle`` (N,) rad of its normal in [-pi, pi]; ``own``
    (N,) px standard deviation of the noise that is alike at neighbours, and ``variance`` (N,) px² of all noise. ``correlation_rad``
    [outline]: the turn over which it is alike.
    """

    outline: Int[NDArray[np.int64], " N"]
    angle: Float[NDArray[np.float64], " N"]
    own: Float[NDArray[np.float64], " N"]
    variance: Float[NDArray[np.float64], " N"]
    correlation_rad: Float[NDArray[np.float64], " s"]

    def covariance(self, weights: Float[NDArray[np.float64], "N p"]) -> Float[NDArray[np.float64], "p p"]:
        """Covariance of ``sum weightsᵀ e``."""
        half = weights.T @ self.half(weights)
        return np.asarray(half + half.T)

    def half(self, weights: Float[NDArray[np.float64], "N p"]) -> Float[NDArray[np.float64], "N p"]:
        """``H weights``, where ``H + Hᵀ`` is the covariance of the noise: of two tangents one is behind the other."""
        return np.asarray(_half(weights, self._order, self.outline, self.angle, self.own, self.variance, self.correlation_rad))

    @cached_property
    def _order(self) -> Int[NDArray[np.int64], " N"]:
        """Tangents by outline, and by angle within it."""
        return np.lexsort((self.angle, self.outline))


@numba.njit(cache=True)
def _half(weights, order, outline, angle, own, variance, correlation_rad):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """``order``: tangents by outline, and by angle within it."""
    half, first = np.zeros(weights.shape), 0
    while first < len(order):
        number, end = outline[order[first]], first
        while end < len(order) and outline[order[end]] == number:
            end += 1
        if number >= 0:
            _half_of_one(weights, order[first:end], angle, own, variance, correlation_rad[number], half)
        first = end
    return half


@numba.njit(cache=True)
def _half_of_one(weights, here, angle, own, variance, correlation_rad, half):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Two rounds of the outline: the first gathers what is behind the first tangent of the second."""
    q, p = len(here), weights.shape[1]
    behind, oldest = np.zeros(p), 0
    for t in range(2 * q):
        now = here[t % q]
        if t > 0:
            before = here[t % q - 1]
            step = angle[now] - angle[before] + (2.0 * np.pi if t == q else 0.0)
            fade = np.exp(-step / correlation_rad)
            for c in range(p):
                behind[c] = (behind[c] + own[before] * weights[before, c]) * fade
        while oldest < t:
            old = here[oldest % q]
            apart = angle[now] - angle[old]
            if oldest < q <= t:  # the same difference as seen from the other, so that both never agree
                if -apart > np.pi:
                    break
                apart += 2.0 * np.pi
            elif apart <= np.pi:
                break
            fade = np.exp(-apart / correlation_rad)
            for c in range(p):
                behind[c] -= own[old] * weights[old, c] * fade
            oldest += 1
        if t >= q:
            for c in range(p):
                half[now, c] = own[now] * behind[c] + 0.5 * variance[now] * weights[now, c]
