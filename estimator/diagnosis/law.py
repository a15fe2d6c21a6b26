"""A law for an unknown force or torque: sparse regression of what the sequences say together on a library of terms.

Terms of :mod:`estimator.effects.empirical.law_terms` are taken up one after the other (forward selection, then what became superfluous is
dropped) as long as Schwarz's criterion falls: remainder of the white regression plus the logarithm of its number of data per parameter
[Schwarz 1978; Brunton, Proctor and Kutz 2016 on sparse regression for dynamics]. Of sets whose criteria differ by less than ``MARGIN`` that
of the fewest numbers counts, or the first of the library, which goes from simple to involved; the others are alternatives. A single term
that the catalogue has is an alternative at most: whoever asks for a law has tried the catalogue.

Amplitudes are eliminated (variable projection [Golub and Pereyra 1973]); exponents and places are found by nonlinear least squares from
the best of a grid. An exponent is held at usual values while terms compete, unless freeing it is worth a parameter; its interval is its
profile likelihood's. The law takes a usual value where the interval has one, since places and exponents are all but degenerate over
short ways.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares
from scipy.special import chdtri

from estimator.diagnosis.pooled_scores import PooledScores
from estimator.diagnosis.selection.groups import FACTOR
from estimator.effects.empirical.law_terms import TERMS, Term

Array = NDArray[np.float64]
MOST_TERMS, BEST_STARTS = 4, 3
"""Terms of a law, and values of its exponents and places from which a fit begins. By judgement."""
RISE_95 = float(chdtri(1, 1.0 - 0.95))
"""Rise of minus twice the log likelihood at the ends of a 95% interval of one number."""
MARGIN = 2.0 * float(np.log(FACTOR))
"""Difference of Schwarz's criterion, about twice that of log evidence, within which both of two laws are listed (decision 47)."""
KNOWN = ("constant", "across_velocity")
"""Terms without an exponent that are in the catalogue as they are (gravity, Magnus lift)."""


@dataclass(frozen=True)
class Shaped:
    """A term with values ``shape`` (k,) of the parameters that shape it; ``held``: whether its exponent is taken for known."""

    term: Term
    shape: Array
    held: bool = False

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which of the shape's parameters (k,) are fitted."""
        return np.array([not (self.held and p.name == self.term.power) for p in self.term.shapes], dtype=np.bool_)

    @property
    def size(self) -> int:
        """Number of fitted parameters."""
        return self.term.amplitudes + int(self.free.sum())


@dataclass(frozen=True)
class Regressed:
    """A set of terms at its best: amplitudes one after the other, what it leaves, and the criterion; ``amplitudes`` (a,)."""

    terms: tuple[Shaped, ...]
    amplitudes: Array
    remainder: float
    criterion: float

    @property
    def keys(self) -> tuple[str, ...]:
        """The terms' keys."""
        return tuple(each.term.key for each in self.terms)


@dataclass(frozen=True)
class Exponent:
    """An exponent: best value, 95% interval (profile likelihood, cut at the values it may have), and the value taken for the law."""

    term: str
    parameter: str
    best: float
    interval: tuple[float, float]
    taken: float


@dataclass(frozen=True)
class Law:
    """The best set of terms, its exponents, others whose criterion lies within the margin, and what no term at all leaves."""

    best: Regressed
    exponents: tuple[Exponent, ...]
    alternatives: tuple[Regressed, ...]
    nothing: float
    columns: int

    @property
    def explained(self) -> float:
        """Share of what is above noise that the law explains."""
        return float(np.clip((self.nothing - self.best.remainder) / max(self.nothing - self.columns, 1e-12), 0.0, 1.0))


def find_law(pooled: PooledScores, *, terms: Sequence[Term] = TERMS) -> Law | None:
    """The law that explains most with least, or nothing where none is better than no law."""
    nothing, penalty = float(pooled.y @ pooled.y), float(np.log(len(pooled.y)))
    tried: dict[frozenset[str], Regressed] = {}
    best = Regressed((), np.zeros(0), nothing, nothing)
    while len(best.terms) < MOST_TERMS:
        found = [_with(pooled, best.terms, term, penalty) for term in terms if term.key not in best.keys]
        tried.update((frozenset(each.keys), each) for each in found)
        first = min(found, key=lambda each: each.criterion, default=best)
        if first.criterion >= best.criterion:
            break
        best = _freed(pooled, first, penalty)
    best = _dropped(pooled, best, penalty)
    if not best.terms:
        return None
    tried[frozenset(best.keys)] = best
    tried.update((frozenset(each.keys), each) for each in _replaced(pooled, best, terms, penalty))
    best = _first(tried.values(), nothing)
    if not best.terms:
        return None
    best, exponents = _simple(pooled, best, penalty)
    others = sorted((each for keys, each in tried.items() if keys != frozenset(best.keys)), key=lambda each: each.criterion)
    close = tuple(each for each in others if each.criterion <= best.criterion + MARGIN)
    return Law(best, exponents, close, nothing, len(pooled.y))


def _first(tried: Iterable[Regressed], nothing: float) -> Regressed:
    """The simplest of the best sets."""
    unknown = [each for each in tried if each.criterion < nothing and not (len(each.terms) == 1 and each.keys[0] in KNOWN)]
    if not unknown:
        return Regressed((), np.zeros(0), nothing, nothing)
    least = min(each.criterion for each in unknown)
    order = [term.key for term in TERMS]
    close = [each for each in unknown if each.criterion <= least + MARGIN]
    return min(close, key=lambda each: (len(each.terms), sum(t.size for t in each.terms), [order.index(key) for key in each.keys]))


def _with(pooled: PooledScores, terms: tuple[Shaped, ...], term: Term, penalty: float) -> Regressed:
    """A set with one term more, from the best of its starts."""
    starts = term.places(pooled.moments.x)
    known = _design(pooled, terms)
    Q = np.linalg.qr(known)[0] if known.shape[1] else known
    y = pooled.y - Q @ (Q.T @ pooled.y)
    columns = pooled.columns(term, starts)
    columns = columns - Q @ (Q.T @ columns)
    q = np.linalg.qr(columns)[0]
    gain = np.sum(np.einsum("sra,r->sa", q, y) ** 2, axis=1)
    tried = (regress(pooled, (*terms, Shaped(term, starts[i], held=True)), penalty) for i in np.argsort(-gain)[:BEST_STARTS])
    return min(tried, key=lambda each: each.criterion)


def _freed(pooled: PooledScores, best: Regressed, penalty: float) -> Regressed:
    """The set with free exponents where that is worth a parameter."""
    for number, each in enumerate(best.terms):
        if each.held and each.term.power is not None:
            best = min(best, _with_free(pooled, best, number, penalty), key=lambda tried: tried.criterion)
    return best


def _with_free(pooled: PooledScores, best: Regressed, number: int, penalty: float) -> Regressed:
    """The set with the exponent of one term free."""
    return regress(pooled, tuple(replace(t, held=t.held and i != number) for i, t in enumerate(best.terms)), penalty)


def _dropped(pooled: PooledScores, best: Regressed, penalty: float) -> Regressed:
    """The set without terms that others made superfluous."""
    while len(best.terms) > 1:
        fewer = [regress(pooled, tuple(t for t in best.terms if t is not out), penalty) for out in best.terms]
        first = min(fewer, key=lambda each: each.criterion)
        if first.criterion > best.criterion:
            return best
        best = first
    return best


def _replaced(pooled: PooledScores, best: Regressed, terms: Iterable[Term], penalty: float) -> list[Regressed]:
    """The sets in which one term is another of the same link."""
    pairs = [(out, term) for out in best.terms for term in terms if term.key not in best.keys and term.link == out.term.link]
    return [_with(pooled, tuple(t for t in best.terms if t is not out), term, penalty) for out, term in pairs]


def _design(pooled: PooledScores, terms: Iterable[Shaped]) -> Array:
    blocks = [pooled.columns(each.term, each.shape[None])[0] for each in terms]
    return np.concatenate([np.zeros((len(pooled.y), 0)), *blocks], axis=1)


def _linear(pooled: PooledScores, terms: Sequence[Shaped]) -> tuple[Array, Array]:
    """Best amplitudes and what they leave (r,)."""
    X = _design(pooled, terms)
    scale = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    theta, *_ = np.linalg.lstsq(X / scale, pooled.y, rcond=1e-10)
    return theta / scale, pooled.y - X / scale @ theta


def regress(pooled: PooledScores, terms: tuple[Shaped, ...], penalty: float) -> Regressed:
    """The best amplitudes and shapes of a set of terms."""
    free = [each.free for each in terms]
    start = np.concatenate([np.zeros(0), *(each.shape[f] for each, f in zip(terms, free, strict=True))])
    if len(start):
        limits = np.array([_limits(each, name) for each, f in zip(terms, free, strict=True) for name in np.flatnonzero(f).tolist()])

        def left_by(shape: Array) -> Array:
            return _linear(pooled, _shaped(terms, shape))[1]

        found = least_squares(
            left_by,
            np.clip(start, limits[:, 0], limits[:, 1]),
            bounds=(limits[:, 0], limits[:, 1]),
            x_scale=np.array([each.term.shapes[i].step for each, f in zip(terms, free, strict=True) for i in np.flatnonzero(f)]) * 100.0,
            max_nfev=40,
        )
        terms = _shaped(terms, found.x)
    amplitudes, left = _linear(pooled, terms)
    remainder = float(left @ left)
    criterion = remainder + penalty * sum(each.size for each in terms)
    return Regressed(terms, amplitudes, remainder, criterion if _sensible(terms, amplitudes) else np.inf)


def _sensible(terms: Sequence[Shaped], amplitudes: Array) -> bool:
    """Whether amplitudes that have to be positive are."""
    starts = np.cumsum([0, *(each.term.amplitudes for each in terms)])
    return not any(each.term.positive and amplitudes[a] < 0.0 for each, a in zip(terms, starts[:-1], strict=True))


def _limits(each: Shaped, number: int) -> tuple[float, float]:
    return each.term.powers if each.term.shapes[number].name == each.term.power else (-np.inf, np.inf)


def _shaped(terms: Sequence[Shaped], shape: Array) -> tuple[Shaped, ...]:
    """The terms with free shape parameters taken from ``shape``."""
    made, place = [], 0
    for each in terms:
        free, values = each.free, each.shape.copy()
        values[free] = shape[place : place + int(free.sum())]
        place += int(free.sum())
        made.append(Shaped(each.term, values, each.held))
    return tuple(made)


def _simple(pooled: PooledScores, best: Regressed, penalty: float) -> tuple[Regressed, tuple[Exponent, ...]]:
    """The law with usual exponents where the data allow them, and all exponents with their intervals."""
    exponents = []
    for number, each in enumerate(best.terms):
        if each.term.power is None:
            continue
        which = number, [p.name for p in each.term.shapes].index(each.term.power)
        free = _with_free(pooled, best, number, penalty)
        interval = _profile(pooled, free, which)
        value = float(free.terms[number].shape[which[1]])
        taken = next((n for n in each.term.usual if interval[0] <= n <= interval[1]), value)
        best = _held_at(pooled, free, which, taken, penalty)
        exponents.append(Exponent(each.term.key, each.term.power, value, interval, taken))
    return best, tuple(exponents)


def _held_at(pooled: PooledScores, at: Regressed, which: tuple[int, int], value: float, penalty: float) -> Regressed:
    number, column = which
    shape = at.terms[number].shape.copy()
    shape[column] = value
    terms = tuple(Shaped(t.term, shape, True) if i == number else t for i, t in enumerate(at.terms))
    return regress(pooled, terms, penalty)


def _profile(pooled: PooledScores, best: Regressed, which: tuple[int, int]) -> tuple[float, float]:
    """Where the remainder, everything else at its best, is higher by what 95% allow."""
    number, column = which
    low, high = best.terms[number].term.powers
    value = float(best.terms[number].shape[column])
    spread = max(1.0, best.remainder / max(len(pooled.y) - sum(t.size for t in best.terms), 1))

    def above(power: float) -> float:
        return _held_at(pooled, best, which, power, 0.0).remainder - best.remainder - RISE_95 * spread

    ends = []
    for end in (low, high):
        inside = abs(end - value) < 1e-6 or above(end) <= 0.0
        ends.append(end if inside else float(brentq(above, min(value, end), max(value, end), xtol=1e-3)))
    return ends[0], ends[1]
