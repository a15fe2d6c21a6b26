"""Values that every sequence has for itself under Student's prior of one scale, found by expectation and maximisation.

Each sequence's precision ``w_s`` and its values are found in turn, its step lengthened by the rate at which its own converges [Lange 1995
on the acceleration of expectation and maximisation]. Where the units of the sequences are independent of one another, which is the rule,
a round is a few sums: it is compiled, since a search looks at some ten thousand sets and scales.
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray
from scipy.special import gammaln

from estimator.likelihood.reduced import Own, Posterior, posterior

Array = NDArray[np.float64]
MOST_WEIGHED, WEIGHED, AT_ONCE = 12, 0.02, 4.0
"""Times that sequences' precisions and values are found in turn at most, the relative change after which they have settled, and how many
steps of a slow sequence are taken at once at most."""


@dataclass(frozen=True)
class Weighed:
    """The ``few`` columns' posterior, units' means ``own`` (m,) and variances ``spread`` (m,), and sequences' ``precision`` (s,)."""

    few: Posterior
    own: Array
    spread: Array
    precision: Array


@dataclass(frozen=True)
class Noise:
    """Most probable variance of the noise over what its model says: ``known + per_misfit`` times what is left."""

    known: float
    per_misfit: float

    def at(self, misfit: float) -> float:
        """For what a set leaves."""
        return self.known + self.per_misfit * misfit


@dataclass(frozen=True)
class Student:
    """The prior of a sequence's values: its ``scale`` in units of their limits, and its degrees of ``freedom``."""

    scale: float
    freedom: float


def with_tails(own: Own, student: Student, sigma: Array, noise: Noise) -> tuple[Weighed, float]:
    """Units of every sequence under one ``student`` prior, the few columns under ``sigma`` (k,).

    Beside it what the integral over the precisions adds to the log evidence (nats).
    """
    q = own.sums(np.ones(len(own.owner)))
    found = (_weighed_apart if own.information.ndim == 1 else weighed_in_turn)(own, student, sigma, noise)
    w = found.precision
    told = np.maximum(q - w * own.sums(found.spread) / student.scale**2, 0.0)
    return found, float(np.sum(0.5 * student.freedom * (np.log(w) - w + 1.0) + _width_of_precision(told, student.freedom)))


def weighed_in_turn(own: Own, student: Student, sigma: Array, noise: Noise) -> Weighed:
    """Units that may share information, the few columns under ``sigma`` (k,); where they do not, this is what :func:`_apart` compiles."""
    scale, freedom, q = student.scale, student.freedom, own.sums(np.ones(len(own.owner)))
    w = np.ones(len(q))
    for _ in range(MOST_WEIGHED):
        quadratic, covariance = own.eliminated(scale**2 / w)
        shared = posterior(quadratic, sigma)
        values, variance = own.units(covariance, shared.mean), covariance if covariance.ndim == 1 else np.diag(covariance)
        square = values**2 / noise.at(shared.misfit)
        size = freedom + own.sums(square + variance) / scale**2
        rate = w * own.sums(variance * (variance + 2.0 * square)) / (size * scale**4)
        step = np.log((freedom + q) / (size * w)) / np.maximum(1.0 - rate, 1.0 / AT_ONCE)
        w = w * np.exp(step)
        if np.abs(step).max() < WEIGHED:
            break
    return Weighed(shared, values, variance, w)


def _weighed_apart(own: Own, student: Student, sigma: Array, noise: Noise) -> Weighed:
    few = own.few
    units = own.information, own.pull, np.ascontiguousarray(own.cross), own.owner
    start = np.ascontiguousarray(few.information), few.pull, few.misfit, few.half_log_det
    prior = student.scale, student.freedom
    mean, factor, misfit, half, values, variance, w = _apart(units, start, prior, sigma, (noise.known, noise.per_misfit))
    return Weighed(Posterior(mean, sigma, factor, misfit, half), values, variance, w)


@numba.njit(cache=True)
def _apart(units, start, student, sigma, noise):  # type: ignore[no-untyped-def]
    """The few columns' mean, factor, misfit and half log determinant; the units' means and variances; the sequences' precisions."""
    information, pull, cross, owner = units
    (scale, freedom), sequences, k = student, owner.max() + 1, len(sigma)
    w, values, variance = np.ones(sequences), np.empty(len(owner)), np.empty(len(owner))
    mean, factor, misfit, half = np.empty(k), np.empty((k, k)), 0.0, 0.0
    for _ in range(MOST_WEIGHED):
        factor[:], mean[:], misfit, half = start[0], start[1], start[2], start[3]
        for i in range(len(owner)):
            prior = scale**2 / w[owner[i]]
            variance[i] = prior / (1.0 + prior * information[i])
            half += 0.5 * np.log(1.0 + prior * information[i])
            misfit -= variance[i] * pull[i] ** 2
            for a in range(k):
                mean[a] -= cross[i, a] * variance[i] * pull[i]
                for b in range(a + 1):
                    factor[a, b] -= cross[i, a] * variance[i] * cross[i, b]
        log_det, taken = _solved_in_place(factor, mean, sigma)
        half, misfit = half + 0.5 * log_det, misfit - taken
        size, slope, q = np.full(sequences, freedom), np.zeros(sequences), np.zeros(sequences)
        for i in range(len(owner)):
            left = pull[i]
            for a in range(k):
                left -= cross[i, a] * mean[a]
            values[i] = variance[i] * left
            square = values[i] ** 2 / (noise[0] + noise[1] * misfit)
            size[owner[i]] += (square + variance[i]) / scale**2
            slope[owner[i]] += variance[i] * (variance[i] + 2.0 * square)
            q[owner[i]] += 1.0
        longest = 0.0
        for s in range(sequences):
            rate = w[s] * slope[s] / (size[s] * scale**4)
            step = np.log((freedom + q[s]) / (size[s] * w[s])) / max(1.0 - rate, 1.0 / AT_ONCE)
            w[s] *= np.exp(step)
            longest = max(longest, abs(step))
        if longest < WEIGHED:
            break
    return mean, factor, misfit, half, values, variance, w


@numba.njit(cache=True)
def _solved_in_place(A, b, sigma):  # type: ignore[no-untyped-def]
    """``1 + D A D`` of the lower half of A becomes its factor, b the mean ``D (1 + D A D)⁻¹ D b``; log determinant, and what it takes."""
    k, log_det, taken = len(b), 0.0, 0.0
    for i in range(k):
        b[i] *= sigma[i]
        for j in range(i + 1):
            value = sigma[i] * A[i, j] * sigma[j] + (1.0 if i == j else 0.0)
            for n in range(j):
                value -= A[i, n] * A[j, n]
            if i == j and not value > 0.0:
                raise LinAlgError("expected a positive definite matrix")
            A[i, j] = np.sqrt(value) if i == j else value / A[j, j]
            A[j, i] = A[i, j] if i == j else 0.0
            if j < i:
                b[i] -= A[i, j] * b[j]
        b[i] /= A[i, i]
        log_det, taken = log_det + 2.0 * np.log(A[i, i]), taken + b[i] ** 2
    for i in range(k - 1, -1, -1):
        for n in range(i + 1, k):
            b[i] -= A[n, i] * b[n]
        b[i] /= A[i, i]
    for i in range(k):
        b[i] *= sigma[i]
    return log_det, taken


def _width_of_precision(told: Array, freedom: float) -> Array:
    """Logarithm of what the integral over a sequence's precision has beside its peak, of the dimensions ``told`` (s,) by the data.

    Exact where all are told: Student's density over its largest normal one; nothing where none is.
    """
    after = freedom + told
    peak = 0.5 * after * np.log(after / freedom) - 0.5 * told
    return np.asarray(gammaln(0.5 * after) - gammaln(0.5 * freedom) - 0.5 * told * np.log(0.5 * freedom) - peak)
