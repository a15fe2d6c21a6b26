"""Noise that is alike from row to row, estimated from what a first fit of free flight leaves: of trajectories, and of outlines' movements.

A polynomial in time is taken off the residuals of every sequence and channel first, so that what a model misses does not count as noise,
and rows that are far off are set aside. What is left, ``P r``, has the covariance ``sigma² P K P``, where ``K`` is that of an
ARMA(1, 1) process, ``rho_k = rho_1 phi^(k-1)`` [Box, Jenkins, Reinsel and Ljung 2015, ch. 3]: rows may be alike over two or three, fade
slowly, or do so beside noise that does not. Its ``rho_1`` and ``phi`` are means over all that there are, by how near their expected
products with the next row and the one after, over the squares, are to the measured ones; ``sigma`` follows from the squares. Such noise
weighs on slow effects as white noise of a variance ``repeats`` times as large would, which is what fits and tests are told.

Whatever is faster than those polynomials counts as noise, a shaking table as much as a bad tracker: only noise that is stated tells them
apart. Where it is, the stated size stands, and only the likeness of rows is estimated: residuals that are larger than stated are not noise,
and what they have too much is taken off before.

Polynomials of short flights are poor, and a wobble is none: there a misfit would count as noise, and hide what makes it. So
:func:`less_explained` takes off what an effect does, too, and :func:`surprise` says by Schwarz's criterion whether that is worth its
amplitudes [Schwarz 1978].

Short flights cannot tell noise that fades slowly from a misfit, so noise is taken to be as alike as is usual among trackers unless the rows
say otherwise: rows are independent, at even odds, or over how many beside one they are alike has a half-Cauchy prior, as scales have
[Gelman 2006]. The axes of a channel are as alike, each of its own size; both are shared by all sequences of a campaign. How well the size
is known says :mod:`estimator.likelihood.noise_freedom`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.special import softmax

from estimator.geometry.robust_scale import robust_sigma

Array = NDArray[np.float64]
Kept = NDArray[np.bool_]
DEGREE, ROWS_PER_DEGREE = 5, 10
"""Of the polynomials: what a missing force or clock does to a flight; one degree for so many rows, as short ones would lose their noise."""
LEAST_ROWS = 3
"""Kept rows beside a polynomial's coefficients; a sequence with fewer keeps all its rows."""
LEAST_TOLD = 0.5
"""Independent rows that have to be left of all sequences together."""
SEEN = 1e-6
"""Of a row, from which on polynomials leave anything of it."""
LONGEST = 500
"""Rows that are looked at together: longer sequences are cut."""
FINE = 9
"""Digits of the times of rows, over half the piece of a sequence that is looked at together."""
LAGS = 3
"""Products are taken of a row with itself, the next and the one after."""
FIRST, FADING = np.linspace(0.0, 0.9, 46), np.linspace(0.0, 0.9, 31)
"""``rho_1`` and ``phi`` that are tried."""
USUAL = 1.0
"""Rows over which noise is alike beside one: the scale of their half-Cauchy density among trackers, before the data (decision 48)."""
CLIP, ROUNDS = 4.0, 8
"""Residuals beyond so many standard deviations count as that far, as in the fit; found by going round."""
WORST = 0.5
"""Of a sequence's largest residual, from which rows are set aside together: what is far off draws its neighbours with it."""


@dataclass(frozen=True)
class ChannelNoise:
    """Noise of one axis of a channel.

    ``sigma``: standard deviation, that of rows that are far off included as far as a fit believes them; ``first``: correlation of a row
    with the next; ``fading``: of each further one, over the one before; ``far``: variance that rows far off add, over that of the others.
    """

    sigma: float
    first: float
    fading: float
    far: float = 0.0

    @property
    def repeats(self) -> float:
        """Over how many rows the noise is alike: the variance of a long mean over that of independent rows of the same ``sigma``."""
        return float((1.0 + 2.0 * self.first / (1.0 - self.fading) + self.far) / (1.0 + self.far))

    def repeats_in(self, rows: int) -> float:
        """The same of the mean of so many ``rows``."""
        distance = np.arange(1, rows)
        alike = 2.0 * float(np.sum(self.first * self.fading ** (distance - 1) * (1.0 - distance / rows)))
        return (1.0 + alike + self.far) / (1.0 + self.far)


@dataclass(frozen=True)
class AxisRows:
    """What the rows of one axis say: beside each pair of likeness ``variance`` (k,), and how ``unlike`` (k,) it their products are.

    ``far``: variance that rows far off add, over that of the others.
    """

    variance: Array
    unlike: Array
    far: float

    def sigma(self, probable: Array) -> float:
        """Standard deviation, the mean of its logarithm, of those beside pairs that are as ``probable`` (k,)."""
        return float(np.exp(0.5 * probable @ np.log(self.variance)))


def axis_rows(residuals: Sequence[Array], times: Sequence[Array] | None = None) -> AxisRows | None:
    """Of the residuals (n,) of several sequences; ``None`` where polynomials leave nothing of them.

    ``times`` (n,) s of each; left out: rows are evenly spaced.
    """
    pieces, at = parts(residuals), _spans(residuals, times)
    kept = _near(pieces, at)
    rows = [_Rows.of(each, u) for each, u in zip(kept, at, strict=True)]
    left = [_projector(each) @ r for r, each in zip(pieces, rows, strict=True)]
    expected = np.sum([_expected(each) for each in rows], axis=0)
    if expected[0, 0] < LEAST_TOLD:
        return None
    products = np.array([sum(float(r[lag:] @ r[: len(r) - lag]) for r in left) for lag in range(LAGS)])
    dropped, count = sum(int(np.sum(~each)) for each in kept), sum(map(len, kept))
    return AxisRows(*_matched(products, expected), CLIP**2 * dropped / max(count, 1))


def noise_of(axes: Sequence[AxisRows], *, stated: bool = False) -> list[ChannelNoise]:
    """Noise of the ``axes`` of one channel, all as alike and each of its size.

    Where that is ``stated``, residuals are in standard deviations, and each axis is as alike as it seems: what is no noise in one is not in
    the others.
    """
    if stated:
        return [_beside_stated(axis) for axis in axes]
    probable, first, fading = _likeness(axes)
    return [ChannelNoise(axis.sigma(probable) * float(np.sqrt(1.0 + axis.far)), first, fading, axis.far) for axis in axes]


def _likeness(axes: Sequence[AxisRows]) -> tuple[Array, float, float]:
    """How probable each pair of likeness is by some axes (k,), and their means ``rho_1`` and ``phi``.

    Means are of the logarithms of how many rows are alike and of what fades, in which all that a process can be is convex: the best pair
    alone jumps where two are as good.
    """
    (first, fading), _, usual = _tried()
    probable = softmax(usual - 0.5 * np.sum([axis.unlike for axis in axes], axis=0))
    fades = float(np.exp(probable @ np.log1p(-fading)))
    beside = float(np.expm1(probable @ np.log1p(2.0 * first / (1.0 - fading))))
    return probable, 0.5 * beside * fades, 1.0 - fades


def _beside_stated(axis: AxisRows) -> ChannelNoise:
    """What residuals have beyond the size that is stated is as alike as it can be."""
    probable, rho, fades = _likeness([axis])
    variance = axis.sigma(probable) ** 2
    first, second = np.maximum(rho * np.array([1.0, fades]) * variance - max(variance - 1.0, 0.0), 0.0)
    fading = float(np.clip(second / max(first, 1e-12), 0.0, FADING[-1]))
    return ChannelNoise(1.0, float(first) + 0.5 * axis.far * (1.0 - fading), fading)


def channel_noise(residuals: Sequence[Array], times: Sequence[Array] | None = None, *, stated: bool = False) -> ChannelNoise | None:
    """Noise of one axis alone by residuals (n,) of several sequences at ``times`` (n,) s: :func:`noise_of` of its :func:`axis_rows`."""
    axis = axis_rows(residuals, times)
    return None if axis is None else noise_of([axis], stated=stated)[0]


def likeness_of(products: Float[NDArray[np.float64], " lags"], expected: Float[NDArray[np.float64], "lags longest"]) -> ChannelNoise | None:
    """Noise by sums of products of rows at each lag, ``products``; ``None`` where these say nothing.

    ``expected``: what they are of noise of variance one, over its autocorrelation at each distance.
    """
    return noise_of([AxisRows(*_matched(products, expected), 0.0)])[0] if expected[0, 0] >= LEAST_TOLD else None


def freedom_in(rows: int) -> int:
    """Degrees of freedom that polynomials leave of so many ``rows`` of a sequence."""
    return sum(max(len(r) - _degree(len(r)) - 1, 0) for r in parts([np.zeros(rows)]))


def less_explained(residuals: Sequence[Array], times: Sequence[Array], columns: Sequence[Array]) -> tuple[list[Array], Array]:
    """The ``residuals`` (n,) of several sequences less what ``columns`` (n, k) of each explain beside polynomials, and amplitudes (k,).

    ``times`` (n,) s. Amplitudes are those of all sequences. Columns that are polynomials explain nothing. Rows far off are not asked.
    """
    pieces, at = parts(residuals), _spans(residuals, times)
    P = [_projector(_Rows.of(each, u)) for each, u in zip(_near(pieces, at), at, strict=True)]
    X = np.concatenate([p @ c for p, c in zip(P, parts(columns), strict=True)])
    whole = np.sqrt(np.sum([np.sum(c**2, axis=0) for c in columns], axis=0))
    size = np.linalg.norm(X, axis=0)
    told = size > SEEN * np.maximum(whole, 1e-300)
    y = np.concatenate([p @ r for p, r in zip(P, pieces, strict=True)])
    amplitudes = np.zeros(len(size))
    amplitudes[told] = np.linalg.lstsq(X[:, told] / size[told], y, rcond=SEEN)[0] / size[told]
    return [r - c @ amplitudes for r, c in zip(residuals, columns, strict=True)], amplitudes


def surprise(residuals: Sequence[Array], times: Sequence[Array], noise: ChannelNoise) -> float:
    """Minus twice the log likelihood of residuals (n,) of several sequences beside polynomials, noise of this likeness and any size.

    ``times`` (n,) s.
    """
    pieces, at = parts(residuals), _spans(residuals, times)
    squares, half_log_det, near = 0.0, 0.0, _near(pieces, at)
    for r, u, each in zip(pieces, at, near, strict=True):
        whitener, design, half = _whitened(_Rows.of(each, u), noise.first, noise.fading)
        white = whitener @ r[each]
        squares += float(np.sum((white - design @ (design.T @ white)) ** 2))
        half_log_det += half
    rows, kept = sum(map(len, near)), int(sum(each.sum() for each in near))
    return rows * float(np.log(max(squares / kept, 1e-300))) + CLIP**2 * (rows - kept) + 2.0 * half_log_det


@dataclass(frozen=True)
class _Rows:
    """Which rows of a piece of a sequence are kept, and when they were, -1 to 1: as bytes, so that what is made of them is made once."""

    kept: bytes
    at: bytes

    @classmethod
    def of(cls, kept: Kept, at: Array) -> "_Rows":
        return cls(kept.tobytes(), at.tobytes())

    @property
    def flags(self) -> Kept:
        """Which are kept (n,)."""
        return np.frombuffer(self.kept, dtype=np.bool_)

    @property
    def polynomials(self) -> Array:
        """Values of the polynomials (n, d) in every row."""
        return polynomials(np.frombuffer(self.at))


def parts(rows: Sequence[Array]) -> list[Array]:
    """Sequences ``rows`` (n, ...) in pieces that are not too long."""
    return [part for r in rows for part in np.array_split(r, max(-(-len(r) // LONGEST), 1))]


def _spans(residuals: Sequence[Array], times: Sequence[Array] | None) -> list[Array]:
    """When the rows of each piece were, from -1 to 1; rounded, so that evenly spaced ones of one length share what is made of them."""
    every = parts([np.arange(len(r), dtype=np.float64) for r in residuals] if times is None else times)
    return [np.round(2.0 * (t - t[0]) / max(float(t[-1] - t[0]), 1e-300) - 1.0, FINE) if len(t) else t for t in every]


@lru_cache(maxsize=256)
def _whitened(rows: _Rows, first: float, fading: float) -> tuple[Array, Array, float]:
    """What makes the noise of kept rows white (k, k), a base of the polynomials then (k, d), half the log determinant of the noise."""
    kept = np.flatnonzero(rows.flags)
    distance = np.abs(np.subtract.outer(kept, kept))
    L = np.linalg.cholesky(np.where(distance == 0, 1.0, first * fading ** np.maximum(distance - 1, 0)))
    whitener = np.linalg.inv(L)
    design, _ = np.linalg.qr(whitener @ rows.polynomials[kept])
    return np.asarray(whitener), np.asarray(design), float(np.sum(np.log(np.diag(L))))


def _near(pieces: Sequence[Array], at: Sequence[Array]) -> list[Kept]:
    """Rows of every sequence that are not far off the polynomial through the others."""
    kept = [np.ones(len(r), dtype=np.bool_) for r in pieces]
    for _ in range(ROUNDS):
        rows = [_Rows.of(each, u) for each, u in zip(kept, at, strict=True)]
        off = [r - _smoother(each) @ r for r, each in zip(pieces, rows, strict=True)]
        spread = [np.sqrt(np.maximum(np.diag(_projector(each)), 0.0)) for each in rows]
        told = [each & (s > SEEN) for each, s in zip(kept, spread, strict=True)]
        sizes = [np.abs(r[t]) / s[t] for r, s, t in zip(off, spread, told, strict=True)]
        every = np.concatenate(sizes) if sizes else np.zeros(0)
        if not len(every):
            break
        sigma = float(robust_sigma(every))
        new = [_kept(np.abs(r), sigma) for r in off]
        if all(np.array_equal(a, b) for a, b in zip(new, kept, strict=True)):
            break
        kept = new
    return kept


def _kept(size: Array, sigma: float) -> Kept:
    """Rows that are near, and those that may only be drawn away by worse ones."""
    near = size <= max(CLIP * sigma, WORST * float(size.max(initial=0.0)))
    return near if near.sum() >= LEAST_ROWS + _degree(len(size)) + 1 else np.ones(len(size), dtype=np.bool_)


def _degree(n: int) -> int:
    return min(DEGREE, max(n // ROWS_PER_DEGREE, 1) + 1)


def polynomials(at: Array) -> Array:
    """Values of the polynomials (n, d) at times ``at`` (n,) from -1 to 1."""
    return np.asarray(legendre.legvander(at, _degree(len(at))))


@lru_cache(maxsize=256)
def _smoother(rows: _Rows) -> Array:
    """What makes the polynomial through the rows that are kept of residuals (n, n)."""
    A = rows.polynomials
    return np.asarray(A @ np.linalg.pinv(A * rows.flags[:, None]))


@lru_cache(maxsize=256)
def _projector(rows: _Rows) -> Array:
    """What takes polynomials off the rows that are kept, and leaves nothing of the others (n, n)."""
    Q, _ = np.linalg.qr(rows.polynomials * rows.flags[:, None])
    return np.asarray(np.diag(rows.flags.astype(np.float64)) - Q @ Q.T)


@lru_cache(maxsize=256)
def _expected(rows: _Rows) -> Array:
    """Expected products of rows at each lag, of noise of variance 1, over its autocorrelation at each distance (``LAGS``, ``LONGEST``)."""
    P = _projector(rows)
    n = len(P)
    distance = np.abs(np.subtract.outer(np.arange(n), np.arange(n))).ravel()
    pairs = [P[lag:].T @ P[: n - lag] for lag in range(LAGS)]
    return np.array([np.bincount(distance, weights=each.ravel(), minlength=LONGEST) for each in pairs])


@lru_cache(maxsize=1)
def _tried() -> tuple[Array, Array, Array]:
    """Every pair of ``FIRST`` and ``FADING`` that a process can have (2, k), its autocorrelations (k, ``LONGEST``), and how probable it is.

    That is a logarithm (k,), before the data: rows are independent or not, at even odds.
    """
    pairs = np.array([(first, fading) for first in FIRST for fading in FADING if first <= 0.5 * (1.0 + fading)])
    rho = np.column_stack([np.ones(len(pairs)), pairs[:, :1] * pairs[:, 1:] ** np.arange(LONGEST - 1)])
    usual = 1.0 / (1.0 + (2.0 * pairs[:, 0] / (1.0 - pairs[:, 1]) / USUAL) ** 2)
    independent = pairs[:, 0] == 0.0
    usual /= np.where(independent, usual[independent].sum(), usual[~independent].sum())
    return pairs.T, rho, np.log(0.5 * usual)


def _matched(products: Array, expected: Array) -> tuple[Array, Array]:
    """Variance (k,) beside each pair, and the squares (k,) of how far its expected products over squares are off the measured ones."""
    each = _tried()[1] @ expected.T
    ratios = each[:, 1:] / np.maximum(each[:, :1], 1e-12)
    unlike = np.sum((ratios - products[1:] / max(products[0], 1e-300)) ** 2, axis=1) * each[:, 0]
    return max(float(products[0]), 1e-300) / np.maximum(each[:, 0], 1e-12), unlike
