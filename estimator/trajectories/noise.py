"""The noise of a trajectory, estimated from what a first fit of free flight leaves.

A polynomial in time is taken off the residuals of every sequence and channel first, so that what a model misses does not count as noise.
What is left, ``P r``, has the covariance ``sigma² P K P`` with ``K_ij = rho^|i-j|`` where the noise of neighbouring rows is alike. ``rho``
is that whose expected ratio of products with the next row to squares is the measured one; ``sigma`` follows from the squares. Such noise
weighs on slow effects as white noise of the variance ``sigma² (1 + rho) / (1 - rho)`` would [Bayley and Hammersley 1946], which is what
fits and tests are told (``repeats``).

Whatever is faster than those polynomials counts as noise, a shaking table as much as a bad tracker: only noise that is stated tells them
apart. The estimate is shared by all sequences of a campaign whose noise nobody states.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import toeplitz

Array = NDArray[np.float64]
DEGREE, ROWS_PER_DEGREE = 5, 5
RHOS = np.linspace(0.0, 0.9, 46)
CLIP, ROUNDS = 4.0, 6
"""Residuals beyond so many standard deviations count as that far, as in the fit; found by going round."""
MEDIAN_OVER_SIGMA = 0.6745


@dataclass(frozen=True)
class ChannelNoise:
    """Standard deviation ``sigma`` of a channel, correlation ``rho`` of neighbouring rows, and the ``repeats`` that it amounts to."""

    sigma: float
    rho: float

    @property
    def repeats(self) -> float:
        """Over how many rows the noise is alike."""
        return (1.0 + self.rho) / (1.0 - self.rho)


def channel_noise(residuals: Sequence[Array]) -> ChannelNoise:
    """Noise of one channel from the residuals (n,) of several sequences."""
    left = [_projector(len(r)) @ r for r in residuals]
    expected = np.sum([_expected(len(r)) for r in residuals], axis=0)
    noise = ChannelNoise(float(np.median(np.abs(np.concatenate(left)))) / MEDIAN_OVER_SIGMA, 0.0)
    for _ in range(ROUNDS):
        noise = _matched([np.clip(r, -CLIP * noise.sigma, CLIP * noise.sigma) for r in left], expected)
    return noise


def _matched(left: Sequence[Array], expected: Array) -> ChannelNoise:
    """The noise whose expected sums are those of ``left``."""
    square = sum(float(r @ r) for r in left)
    product = sum(float(r[1:] @ r[:-1]) for r in left)
    ratios = expected[:, 1] / np.maximum(expected[:, 0], 1e-12)
    best = int(np.argmin(np.abs(ratios - product / max(square, 1e-300))))
    return ChannelNoise(float(np.sqrt(max(square, 1e-300) / max(float(expected[best, 0]), 1e-12))), float(RHOS[best]))


@lru_cache(maxsize=256)
def _projector(n: int) -> Array:
    """What takes polynomials off n rows (n, n)."""
    degree = min(DEGREE, max(n // ROWS_PER_DEGREE, 1) + 1)
    Q, _ = np.linalg.qr(legendre.legvander(np.linspace(-1.0, 1.0, n), degree))
    return np.asarray(np.eye(n) - Q @ Q.T)


@lru_cache(maxsize=256)
def _expected(n: int) -> Array:
    """Expected sum of squares and of products with the next row (k, 2) for each of ``RHOS``, for n rows of noise of variance 1."""
    P = _projector(n)
    covariances = [P @ toeplitz(rho ** np.arange(n)) @ P for rho in RHOS]
    return np.array([[np.trace(C), np.trace(C, offset=1)] for C in covariances])
