"""Values that every sequence has for itself under Student's prior of one scale, found by expectation and maximisation.

Each sequence's precision ``w_s`` and its values are found in turn, its step lengthened by the rate at which its own converges [Lange 1995
on the acceleration of expectation and maximisation]. Where the units of the sequences are independent of one another a round is a few sums,
else a factorisation; both are compiled, since a search evaluates some ten thousand sets and scales.
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray
from scipy.special import gammaln

from estimator.likelihood.reduced import Own, Posterior

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
    found = weighed_in_turn(own, student, sigma, noise)
    w = found.precision
    told = np.maximum(q - w * own.sums(found.spread) / student.scale**2, 0.0)
    return found, float(np.sum(0.5 * student.freedom * (np.log(w) - w + 1.0) + _width_of_precision(told, student.freedom)))


def weighed_in_turn(own: Own, student: Student, sigma: Array, noise: Noise) -> Weighed:
    """Sequences' precisions and values, the few columns under ``sigma`` (k,)."""
    few, rounds = own.few, _apart if own.information.ndim == 1 else _together
    units = np.ascontiguousarray(own.information), own.pull, np.ascontiguousarray(own.cross), own.owner
    start = np.ascontiguousarray(few.information), few.pull, few.misfit, few.half_log_det
    prior = student.scale, student.freedom
    mean, factor, misfit, half, values, variance, w = rounds(units, start, prior, sigma, (noise.known, noise.per_misfit))
    return Weighed(Posterior(mean, sigma, factor, misfit, half), values, variance, w)


@numba.njit(cache=True)
def _apart(units, start, student, sigma, noise):  # type: ignore[no-untyped-def]
    """The few columns' mean, factor, misfit and half log determinant; the units' means and variances; the sequences' precisions."""
    information, pull, cross, owner = units
    k, w, values, variance = len(sigma), np.ones(owner.max() + 1), np.empty(len(owner)), np.empty(len(owner))
    mean, factor, misfit, half = np.empty(k), np.empty((k, k)), 0.0, 0.0
    for _ in range(MOST_WEIGHED):
        factor[:], mean[:], misfit, half = start[0], start[1], start[2], start[3]
        for i in range(len(owner)):
            prior = student[0] ** 2 / w[owner[i]]
            variance[i] = prior / (1.0 + prior * information[i])
            half += 0.5 * np.log(1.0 + prior * information[i])
            misfit -= variance[i] * pull[i] ** 2
            for a in range(k):
                mean[a] -= cross[i, a] * variance[i] * pull[i]
                for b in range(a + 1):
                    factor[a, b] -= cross[i, a] * variance[i] * cross[i, b]
        log_det, taken = _solved_in_place(factor, mean, sigma)
        half, misfit = half + 0.5 * log_det, misfit - taken
        for i in range(len(owner)):
            left = pull[i]
            for a in range(k):
                left -= cross[i, a] * mean[a]
            values[i] = variance[i] * left
        if _changed(w, owner, (values, variance), student, noise[0] + noise[1] * misfit) < WEIGHED:
            break
    return mean, factor, misfit, half, values, variance, w


@numba.njit(cache=True)
def _together(units, start, student, sigma, noise):  # type: ignore[no-untyped-def]
    """What :func:`_apart` finds, of units that share information (m, m)."""
    information, pull, cross, owner = units
    m, k, w, values, variance = len(owner), len(sigma), np.ones(owner.max() + 1), np.empty(len(owner)), np.empty(len(owner))
    mean, factor, misfit, half = np.empty(k), np.empty((k, k)), 0.0, 0.0
    L, root, inverse = np.empty((m, m)), np.empty(m), np.empty((m, m))
    for _ in range(MOST_WEIGHED):
        factor[:], mean[:], misfit, half = start[0], start[1], start[2], start[3]
        for i in range(m):
            root[i] = student[0] / np.sqrt(w[owner[i]])
        half += _inverse_factor(information, root, L, inverse)
        told, seen = inverse @ (root * pull), inverse @ (root.reshape(-1, 1) * cross)
        misfit -= np.sum(told**2)
        for a in range(k):
            mean[a] -= np.sum(seen[:, a] * told)
            for b in range(a + 1):
                factor[a, b] -= np.sum(seen[:, a] * seen[:, b])
        log_det, taken = _solved_in_place(factor, mean, sigma)
        half, misfit = half + 0.5 * log_det, misfit - taken
        values[:] = root * (inverse.T @ (told - seen @ mean))
        for i in range(m):
            variance[i] = root[i] ** 2 * np.sum(inverse[i:, i] ** 2)
        if _changed(w, owner, (values, variance), student, noise[0] + noise[1] * misfit) < WEIGHED:
            break
    return mean, factor, misfit, half, values, variance, w


@numba.njit(cache=True)
def _inverse_factor(information, root, L, inverse):  # type: ignore[no-untyped-def]
    """Half the log determinant of ``1 + D G D``, D the ``root`` (m,) of prior variances; the ``inverse`` of its factor L is written."""
    half = 0.0
    inverse[:] = 0.0
    for i in range(len(root)):
        for j in range(i + 1):
            value = root[i] * information[i, j] * root[j]
            for n in range(j):
                value -= L[i, n] * L[j, n]
            if j < i:
                L[i, j] = value / L[j, j]
            elif not 1.0 + value > 0.0:
                raise LinAlgError("expected a positive definite matrix")
            else:
                L[i, i] = np.sqrt(1.0 + value)
        half += np.log(L[i, i])
        for n in range(i):
            for j in range(n + 1):
                inverse[i, j] -= L[i, n] * inverse[n, j]
        inverse[i, : i + 1] /= L[i, i]
        inverse[i, i] = 1.0 / L[i, i]
    return half


@numba.njit(cache=True)
def _changed(w, owner, units, student, noise):  # type: ignore[no-untyped-def]
    """The largest change of the logarithms of precisions ``w`` (s,), which are changed to what the units' values and variances say."""
    (values, variance), (scale, freedom), longest = units, student, 0.0
    size, slope, q = np.full(len(w), freedom), np.zeros(len(w)), np.zeros(len(w))
    for i in range(len(owner)):
        square = values[i] ** 2 / noise
        size[owner[i]] += (square + variance[i]) / scale**2
        slope[owner[i]] += variance[i] * (variance[i] + 2.0 * square)
        q[owner[i]] += 1.0
    for s in range(len(w)):
        rate = w[s] * slope[s] / (size[s] * scale**4)
        step = np.log((freedom + q[s]) / (size[s] * w[s])) / max(1.0 - rate, 1.0 / AT_ONCE)
        w[s] *= np.exp(step)
        longest = max(longest, abs(step))
    return longest


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
