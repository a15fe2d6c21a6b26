"""Rows that a tracker got wrong: few among others, in a mixture about paths that are smooth in time [Torr and Zisserman 2000].

Errors of rows are Student's, so that tails are noise; a row is spoiled with a probability, and its error is then normal with a variance
that is larger by a factor. Both, and the noise of the others, are those of all sequences together, most probable by expectation and
maximisation [Dempster, Laird and Rubin 1977]: a short flight, whose own rows could not tell, borrows from the others. Paths are polynomials
beside the model's through rows that are not spoiled: first through the half of a sequence's rows that lie best on one.

No row of a sequence is set aside where most were, or so many in a run that they could be a sequence by themselves: something happened to
the body or to the clock. Nor where it is as probable that all its rows are off by a factor of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, gammaln

from estimator.effects.link import TAILS
from estimator.geometry.robust_scale import robust_sigma
from estimator.likelihood.alike_noise import parts, polynomials

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
SIDES = 40
"""Changes of the sides of rows that are free: nearly all searches end within twenty. By judgement."""
TINY = float(np.finfo(np.float64).tiny)


@dataclass(frozen=True)
class Errors:
    """Errors ``t`` (n, c) of rows, of one variance, zero where not ``seen`` (n, c); ``spread`` (n, c): variance of row and path over it."""

    t: Array
    spread: Array
    seen: Flags

    @property
    def axes(self) -> Array:
        """How many axes (n,) were seen in each row."""
        return np.asarray(self.seen.sum(axis=1))

    @classmethod
    def joined(cls, parts: "Sequence[Errors]") -> "Errors":
        """Of all sequences."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("t", "spread", "seen")))


@dataclass(frozen=True)
class Path:
    """Residuals ``r`` (n, c) of one channel of a sequence in any unit, zero where not ``seen`` (n, c), and polynomials ``A`` (n, d)."""

    r: Array
    seen: Flags
    A: Array

    @classmethod
    def of(cls, r: Array, seen: Flags, times_s: Array) -> "list[Path]":
        """Pieces of a sequence with the polynomials that rows at ``times_s`` (n,) s allow; ``r`` (n, c) in any unit."""
        pieces = zip(parts([np.where(seen, r, np.nan)]), parts([times_s]), strict=True)
        span = 2.0 / max(float(np.ptp(times_s)), TINY)
        return [cls(np.nan_to_num(e), np.isfinite(e), polynomials(span * (t - t.mean()))) for e, t in pieces]

    @property
    def rows(self) -> Array:
        """Weights (n,): one of every row in which anything was seen."""
        return np.asarray(self.seen.any(axis=1), dtype=np.float64)

    @property
    def tells(self) -> bool:
        """Whether rows are left beside those that a polynomial takes, and one more, in every axis that was seen."""
        return bool(self.seen.any()) and int(min(n for n in self.seen.sum(axis=0) if n)) > self.A.shape[1] + 1

    def errors(self, weight: Array) -> "Errors":
        """Of every row, about the polynomial through the others, which count ``weight`` (n,)."""
        t, spread, inverses = np.zeros(self.r.shape), np.ones(self.r.shape), self._inverses(weight)
        left = self._left(weight, inverses)
        for c, (seen, inverse) in enumerate(zip(self.seen.T, inverses, strict=True)):
            h = np.sum((self.A @ inverse) ** 2, axis=1)
            others = np.maximum(1.0 - weight * seen * h, np.finfo(np.float64).eps)
            spread[:, c] = (others + h) / others
            t[:, c] = left[:, c] / (others * np.sqrt(spread[:, c]))
        return Errors(t, spread, self.seen)

    def _left(self, weight: Array, inverses: list[Array]) -> Array:
        """Residuals (n, c) of rows about the polynomial through those that count ``weight`` (n,), by its ``inverses``."""
        pulls = np.sqrt(weight)[:, None] * self.seen * self.r
        through = [inverse @ pull for inverse, pull in zip(inverses, pulls.T, strict=True)]
        return np.where(self.seen, self.r - self.A @ np.column_stack(through), 0.0)

    def _inverses(self, weight: Array) -> list[Array]:
        """Pseudo-inverses (d, n) of the polynomials in the rows of each axis, which count ``weight`` (n,)."""
        return [np.linalg.pinv(np.sqrt(weight * seen)[:, None] * self.A) for seen in self.seen.T]

    def core(self) -> Array:
        """Weights (n,): one of the half of the rows that lie best on a polynomial [Rousseeuw and Van Driessen 2006].

        Looked for from all rows, and from such as follow one another.
        """
        rows, d = np.flatnonzero(self.rows), self.A.shape[1]
        half = max(len(rows) // 2, d) + 1
        near = [np.isin(np.arange(len(self.r)), rows[k : k + 2 * d]).astype(np.float64) for k in range(0, len(rows) - d, d)]
        found = [self._concentrated(each, half) for each in (self.rows, *near)]
        return min(found, key=lambda each: each[0])[1]

    def _concentrated(self, weight: Array, half: int) -> tuple[float, Array]:
        """Squares of the ``half`` of the rows that lie best on a polynomial through themselves, and their weights (n,)."""
        least, found = np.inf, weight
        while True:
            square = np.where(self.rows > 0.0, np.sum(self._left(weight, self._inverses(weight)) ** 2, axis=1), np.inf)
            best = np.argsort(square, kind="stable")[:half]
            if square[best].sum() >= least:
                return least, found
            least, found = float(square[best].sum()), weight
            weight = np.isin(np.arange(len(square)), best).astype(np.float64)


@dataclass(frozen=True)
class _Mixture:
    """Scale (c,) of the errors of rows, the ``share`` of spoiled ones, and by what ``factor`` their variance is larger."""

    sigma: Array
    share: float
    factor: float

    def judged(self, rows: Errors) -> tuple[Array, Array]:
        """Probability (n,) of rows to be spoiled, and the log likelihood (n,) of each, of unit scale."""
        z2, larger = (rows.t / self.sigma) ** 2, 1.0 + (self.factor - 1.0) / rows.spread
        normal = np.log(self.share) - 0.5 * np.sum(np.where(rows.seen, np.log(larger) + z2 / larger, 0.0), axis=1)
        others = np.log1p(-self.share) + _tails(z2.sum(axis=1), rows.axes)
        seen = rows.axes > 0
        return np.where(seen, expit(normal - others), 0.0), np.where(seen, np.logaddexp(normal, others), 0.0)

    def improved(self, rows: Errors, least: float) -> "tuple[_Mixture, Array]":
        """The mixture after a turn, its scales no smaller than ``least``, and the probability (n,) of rows to be spoiled before it."""
        spoiled, _ = self.judged(rows)
        weight = (1.0 - spoiled) * (TAILS + rows.axes) / (TAILS + np.sum((rows.t / self.sigma) ** 2, axis=1))
        sigma = np.maximum(np.sqrt(weight @ rows.t**2 / np.maximum((1.0 - spoiled) @ rows.seen, TINY)), least)
        factor = spoiled @ np.sum((rows.t / sigma) ** 2 * rows.spread, axis=1) / max(float(spoiled @ rows.axes), TINY)
        share = float(spoiled.sum()) / int(np.count_nonzero(rows.axes))
        return _Mixture(sigma, min(max(share, TINY), 0.5), max(float(factor), 1.0)), spoiled

    def log_likelihood(self, rows: Errors) -> float:
        """Of all rows, of unit scale."""
        return float(self.judged(rows)[1].sum())

    def kept(self, path: Path, spoiled: Array, odds: float) -> Flags:
        """Rows (n,) of a path that are not ``spoiled`` (n,), probabilities, by such ``odds``.

        All, where most are, or a run that could be a sequence by itself, or where it is as probable that all are off by a factor.
        """
        off, every, alone = spoiled > odds / (1.0 + odds), path.rows > 0.0, path.A.shape[1] + 2
        run = np.convolve(off[every], np.ones(alone)).max()
        few = run < alone and 2 * np.count_nonzero(off) <= np.count_nonzero(every)
        if few and self.judged(path.errors(path.rows * ~off))[1].sum() > self._alone(path.errors(path.rows)) + np.log(odds):
            return ~off
        return np.ones(len(off), dtype=np.bool_)

    def _alone(self, rows: Errors) -> float:
        """Log likelihood of a sequence whose errors are all larger, by what its usual row says."""
        seen = rows.axes > 0
        z2, c = np.sum((rows.t[seen] / self.sigma) ** 2, axis=1), rows.axes[seen]
        larger = max(float(np.median(z2 / c)), 1.0)
        return float(np.sum(_tails(z2 / larger, c) - 0.5 * c * np.log(larger)))


def _tails(z2: Array, c: Array) -> Array:
    """Logarithm of Student's density of rows with squares ``z2`` (n,) of ``c`` (n,) axes; without what is common to normal ones."""
    return np.asarray(
        gammaln(0.5 * (TAILS + c)) - gammaln(0.5 * TAILS) - 0.5 * (c * np.log(0.5 * TAILS) + (TAILS + c) * np.log1p(z2 / TAILS))
    )


def kept_rows(sequences: Sequence[Sequence[Path]], odds: float, least: float) -> list[Flags]:
    """Rows (n,) of every sequence, in pieces, that are not spoiled by such ``odds``; scales of errors are at least ``least``."""
    kept = [[np.ones(len(path.r), dtype=np.bool_) for path in pieces] for pieces in sequences]
    told = [(i, k, path) for i, pieces in enumerate(sequences) for k, path in enumerate(pieces) if path.tells]
    if told:
        mixture, every = _spoiled([path for _, _, path in told], least)
        for (i, k, path), spoiled in zip(told, every, strict=True):
            kept[i][k] = mixture.kept(path, spoiled, odds)
    return [np.concatenate(pieces) for pieces in kept]


def _spoiled(paths: Sequence[Path], least: float) -> tuple[_Mixture, list[Array]]:
    """The most probable mixture, and the probability (n,) of the rows of every sequence to be spoiled.

    Paths go through rows that are rather not; it ends, too, where the sides of all rows are some that they were on before. Where noise has
    heavy tails many rows are nearly off, and sides change for ever: after ``SIDES`` changes each has to be more probable.
    """
    ends = np.cumsum([len(path.r) for path in paths])[:-1]
    rows = Errors.joined([path.errors(path.core()) for path in paths])
    sigma = np.array([max(float(robust_sigma(t[s])), least) if s.any() else 1.0 for t, s in zip(rows.t.T, rows.seen.T, strict=True)])
    factor = max(float(np.max((rows.t / sigma) ** 2 * rows.spread)), 1.0)
    mixture, before, sides = _Mixture(sigma, 1.0 / len(rows.t), factor), np.zeros(len(rows.t)), [b""]
    while True:
        mixture, spoiled = mixture.improved(rows, least)
        off, settled = spoiled > 0.5, np.abs(spoiled - before).sum() * len(before) < 1.0
        if settled or off.tobytes() in sides[:-1]:
            return mixture, np.split(spoiled, ends)
        if off.tobytes() != sides[-1]:
            new = Errors.joined([path.errors(path.rows * ~each) for path, each in zip(paths, np.split(off, ends), strict=True)])
            if len(sides) <= SIDES or mixture.log_likelihood(new) > mixture.log_likelihood(rows):
                sides.append(off.tobytes())
                rows = new
        before = spoiled
