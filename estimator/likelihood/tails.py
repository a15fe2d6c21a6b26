"""Values that every sequence has for itself under Student's priors, found by expectation and maximisation.

The values of one effect in one sequence are a group. Each group's precision ``w`` and its values are found in turn, its step lengthened by
the rate at which its own converges [Lange 1995 on the acceleration of expectation and maximisation]. A round factorises block by block
what sequences have for themselves; it is compiled, since a search evaluates some ten thousand sets and scales.
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
"""Times that groups' precisions and values are found in turn at most, the relative change after which they have settled, and how many steps
of a slow group are taken at once at most, and how long (in logarithms) a step may become by that."""


@dataclass(frozen=True)
class Weighed:
    """The ``few`` columns' posterior, units' means ``own`` (m,) and variances ``spread`` (m,), and groups' ``precision`` (g,)."""

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
    """The priors of groups of values: their ``scale`` (g,) in units of the values' limits, and their degrees of ``freedom`` (g,)."""

    scale: Array
    freedom: Array


def with_tails(own: Own, student: Student, sigma: Array, noise: Noise) -> tuple[Weighed, float]:
    """Units of every sequence under ``student`` priors, the few columns under ``sigma`` (k,).

    Beside it what the integral over the precisions adds to the log evidence (nats).
    """
    q = own.sums(np.ones(len(own.group)))
    found = weighed_in_turn(own, student, sigma, noise)
    w = found.precision
    told = np.maximum(q - w * own.sums(found.spread) / student.scale**2, 0.0)
    return found, float(np.sum(0.5 * student.freedom * (np.log(w) - w + 1.0) + _width_of_precision(told, student.freedom)))


def weighed_in_turn(own: Own, student: Student, sigma: Array, noise: Noise) -> Weighed:
    """Groups' precisions and values, the few columns under ``sigma`` (k,)."""
    few = own.few
    units = own.information, own.pull, own.cross, own.group, own.blocks
    start = np.ascontiguousarray(few.information), few.pull, few.misfit, few.half_log_det
    prior = student.scale, student.freedom
    mean, factor, misfit, half, values, variance, w = _in_turn(units, start, prior, sigma, (noise.known, noise.per_misfit))
    return Weighed(Posterior(mean, sigma, factor, misfit, half), values, variance, w)


@numba.njit(cache=True)
def _in_turn(units, start, student, sigma, noise):  # type: ignore[no-untyped-def]
    """The few columns' mean, factor, misfit and half log determinant; the units' means and variances; the groups' precisions."""
    information, pull, cross, group, blocks = units
    m, k, w, values, variance = len(group), len(sigma), np.ones(len(student[0])), np.empty(len(group)), np.empty(len(group))
    mean, factor, misfit, half = np.empty(k), np.empty((k, k)), 0.0, 0.0
    widest = np.max(blocks[1:] - blocks[:-1])
    L, inverse, told, seen = np.empty((m, widest)), np.empty((m, widest)), np.empty(m), np.empty((m, k))
    for _ in range(MOST_WEIGHED):
        root = (student[0] / np.sqrt(w))[group]
        half = start[3]
        for b in range(len(blocks) - 1):
            half += _whitened((information, pull, cross), root, (blocks[b], blocks[b + 1]), (L, inverse, told, seen))
        misfit = start[2] - np.sum(told**2)
        mean[:], factor[:] = start[1] - seen.T @ told, start[0] - seen.T @ seen
        log_det, taken = _solved_in_place(factor, mean, sigma)
        half, misfit = half + 0.5 * log_det, misfit - taken
        told -= seen @ mean
        for b in range(len(blocks) - 1):
            for i in range(blocks[b], blocks[b + 1]):
                values[i], variance[i] = 0.0, 0.0
                for j in range(i, blocks[b + 1]):
                    weight = root[i] * inverse[j, i - blocks[b]]
                    values[i] += weight * told[j]
                    variance[i] += weight**2
        if _changed(w, group, (values, variance), student, noise[0] + noise[1] * misfit) < WEIGHED:
            break
    return mean, factor, misfit, half, values, variance, w


@numba.njit(cache=True)
def _whitened(units, root, block, at):  # type: ignore[no-untyped-def]
    """Half the log determinant of a ``block``; what its units say of the misfit and the few columns is written, and its inverse factor."""
    (information, pull, cross), (first, end), (L, inverse, told, seen) = units, block, at
    half = _inverse_factor(information, root, block, L, inverse)
    for i in range(first, end):
        told[i] = 0.0
        for n in range(cross.shape[1]):
            seen[i, n] = 0.0
        for j in range(first, i + 1):
            weight = inverse[i, j - first] * root[j]
            told[i] += weight * pull[j]
            for n in range(cross.shape[1]):
                seen[i, n] += weight * cross[j, n]
    return half


@numba.njit(cache=True)
def _inverse_factor(information, root, block, L, inverse):  # type: ignore[no-untyped-def]
    """Half the log determinant of ``1 + D G D`` of a ``block`` of units, D the ``root`` (m,) of prior variances.

    The ``inverse`` (m, widest) of its factor L is written below the diagonal and on it; columns of both count from the block's first unit.
    """
    (first, end), half = block, 0.0
    for i in range(first, end):
        for j in range(first, i + 1):
            value = root[i] * information[i, j] * root[j]
            for n in range(j - first):
                value -= L[i, n] * L[j, n]
            if j < i:
                L[i, j - first] = value / L[j, j - first]
            elif np.isnan(value):
                raise LinAlgError("expected information that is a number")
            else:
                L[i, i - first] = np.sqrt(1.0 + max(value, 0.0))  # of 1 + D G D no pivot is less than one
        pivot = L[i, i - first]
        half += np.log(pivot)
        inverse[i, i - first] = 1.0 / pivot
        for j in range(i - first):
            value = 0.0
            for n in range(j, i - first):
                value -= L[i, n] * inverse[first + n, j]
            inverse[i, j] = value / pivot
    return half


@numba.njit(cache=True)
def _changed(w, group, units, student, noise):  # type: ignore[no-untyped-def]
    """The largest change of the logarithms of precisions ``w`` (g,), which are changed to what the units' values and variances say."""
    (values, variance), (scale, freedom), longest = units, student, 0.0
    size, slope, q = freedom.copy(), np.zeros(len(w)), np.zeros(len(w))
    for i in range(len(group)):
        g, square = group[i], values[i] ** 2 / noise
        size[g] += (square + variance[i]) / scale[g] ** 2
        slope[g] += variance[i] * (variance[i] + 2.0 * square)
        q[g] += 1.0
    for g in range(len(w)):
        rate = w[g] * slope[g] / (size[g] * scale[g] ** 4)
        step = np.log((freedom[g] + q[g]) / (size[g] * w[g]))
        most = max(abs(step), AT_ONCE)  # a rate is that of small steps
        step = min(max(step / max(1.0 - rate, 1.0 / AT_ONCE), -most), most)
        w[g] *= np.exp(step)
        longest = max(longest, abs(step))
    return longest


@numba.njit(cache=True)
def _solved_in_place(A, b, sigma):  # type: ignore[no-untyped-def]
    """``1 + D A D`` of A becomes its factor, b the mean ``D (1 + D A D)⁻¹ D b``; log determinant, and what it takes."""
    L, inverse = np.zeros_like(A), np.zeros_like(A)
    half = _inverse_factor(A, sigma, (0, len(sigma)), L, inverse)
    told = inverse @ (sigma * b)
    A[:], b[:] = L, sigma * (inverse.T @ told)
    return 2.0 * half, np.sum(told**2)


def _width_of_precision(told: Array, freedom: Array) -> Array:
    """Logarithm (g,) of what the integral over groups' precisions has beside the peak, of the dimensions ``told`` (g,) by the data.

    ``freedom`` (g,).

    Exact where all are told: Student's density over its largest normal one; nothing where none is.
    """
    after = freedom + told
    peak = 0.5 * after * np.log(after / freedom) - 0.5 * told
    return np.asarray(gammaln(0.5 * after) - gammaln(0.5 * freedom) - 0.5 * told * np.log(0.5 * freedom) - peak)
