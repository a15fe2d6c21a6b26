"""The marginal likelihood of a set of effects: what the data say of the set, whatever the values of its parameters.

Given the quadratic of :class:`estimator.diagnosis.selection.linearised.Linearised` and a normal prior of covariance ``s² D²`` on the
amplitudes of a set, with ``s²`` the noise's variance over what its model says, the integral over amplitudes and ``s²`` is exact:
``ln p = -1/2 ln det(1 + D G D) - (nu + n)/2 ln(1 + Q / nu)``, ``Q = S(0) - bᵀ D (1 + D G D)⁻¹ D b`` [O'Hagan and Forster 2004,
ch. 11]. ``s²`` has a scaled inverse chi-squared prior of ``nu`` degrees of freedom about 1: the noise model may be wrong by a factor, and a
misfit that no set removes counts as noise. Where each sequence has a noise of its own, a set is taken to change all of their misfits by
one factor, and ``ln p`` is the sum of their densities.

``D`` is not one number. What nature calls plausible spans orders of magnitude, and an effect of a hundredth of its range is no surprise:
each effect's prior is a mixture of normal ones, of standard deviation ``r`` times its plausible limit with ``r`` uniform in its logarithm.
Amplitudes that cannot be negative have half of that prior.

**Values of every sequence** are hierarchical: their prior's ``r`` is the scatter of the values, a part of the answer [Gelman 2006]. It has
tails: a few sequences may differ by far more than the others (Student's density as a scale mixture, each sequence's precision ``w_s``
with a gamma prior about 1 [Lange, Little and Taylor 1989]).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.score_tests import Column
from estimator.diagnosis.selection.linearised import Linearised
from estimator.effects.dependence import idle
from estimator.likelihood.reduced import Own, Posterior, Quadratic, log_share_inside, posterior
from estimator.likelihood.rows import NOISE_FREEDOM
from estimator.likelihood.tails import Noise, Student, with_tails

Array = NDArray[np.float64]
SHARES = 0.5 * np.logspace(-3.0, 0.0, 7)
"""``r``: standard deviations of the prior over the plausible limit, which is two of the widest; less than a thousandth of a range is
nothing (decision 47)."""
UNITS = np.logspace(0.0, 3.0, 7)
"""For amplitudes without a plausible limit: standard deviations of the prior over the least that is seen of their unit (decision 47)."""
BEYOND = 2.0
"""Plausible limits up to which an amplitude is believed at all: signatures are linear no further, and nature hardly goes there.

See decision 47."""
LOG_SCALES = float(np.log(len(SHARES)))
"""What the unknown size of a variance costs that is read at its best."""


@dataclass(frozen=True)
class Scaled:
    """A set: its ``log_evidence`` (nats), and the most probable ``scales`` of the priors of those ``members`` that have columns."""

    members: tuple[int, ...]
    log_evidence: float
    scales: tuple[float, ...]


@dataclass(frozen=True)
class Fitted:
    """A set at its most probable scales.

    ``log_likelihood`` (nats) at the posterior mean, up to what all sets share; ``rows`` (q,) of the columns, their posterior ``mean`` (q,)
    and standard deviations ``sigma`` (q,); ``noise``: ``s²``.
    """

    scaled: Scaled
    log_likelihood: float
    rows: NDArray[np.int64]
    mean: Array
    sigma: Array
    noise: float


@dataclass(frozen=True)
class _At:
    """A set at given scales: log evidence, the few columns with their posterior, and units of the sequences with their variances."""

    value: float
    few: NDArray[np.int64]
    shared: Posterior
    own: Array
    spread: Array


@dataclass(frozen=True)
class _Parts:
    """What of a set is the same at all scales.

    Effects with values of every sequence, by ``groups`` (effect, sequence), are integrated ``out``; the others, ``of_few``, have columns
    ``few`` with ``bounds`` (3, k); what was ``searched`` for (nats).
    """

    of_few: tuple[int, ...]
    few: NDArray[np.int64]
    groups: tuple[tuple[int, int], ...]
    out: Own | None
    bounds: Array
    searched: float


@dataclass
class Evidence:
    """Marginal likelihoods of sets of effects of one linearised campaign; each is worked out once."""

    of: Linearised
    known: dict[tuple[int, ...], Scaled] = field(default_factory=dict)

    def __post_init__(self) -> None:
        effects = range(len(self.of.effects))
        self._rows = [self.of.rows(e) for e in effects]
        self._own = [self._sequences(e) for e in effects]
        none = np.zeros(0, dtype=np.int64)
        self._rows = [self._rows[e] if own is None else np.concatenate([none, *own.values()]) for e, own in enumerate(self._own)]
        self._limits = [self._limit(e) for e in effects]
        self._scales = [SHARES if np.isfinite([p.plausible for p in e.entry.parameters]).all() else UNITS for e in self.of.effects]
        self._bounds = np.array([self._bounds_of(column) for column in self.of.columns]).reshape(-1, 3).T
        self._whole = Quadratic(self.of.information, self.of.pull, self.of.misfit)
        self._apart: dict[tuple[int, ...], Own] = {}
        self._hint: dict[int, int] = {}
        self._parts: dict[tuple[int, ...], _Parts] = {}
        freedom = None if self.of.count is None else NOISE_FREEDOM + self.of.count
        self._noise_model = Noise(1.0, 0.0) if freedom is None else Noise(NOISE_FREEDOM / freedom, 1.0 / freedom)

    def _limit(self, effect: int) -> Array:
        """Plausible limits (q,) of an effect's columns; where nobody says what is plausible, the least that the data see of their unit."""
        parameters = [self.of.effects[effect].entry.parameters[self.of.columns[i].parameter] for i in self._rows[effect]]
        limit, units = np.array([max(map(abs, p.plausible)) for p in parameters]), np.array([p.unit for p in parameters])
        seen = 1.0 / np.sqrt(np.diag(self.of.information)[self._rows[effect]])
        least = np.array([np.min(seen[units == unit]) for unit in units])
        return np.where(np.isfinite(limit), limit, least)

    def _bounds_of(self, column: Column) -> tuple[float, float, bool]:
        """Between which values a column's amplitude is believed, infinite where each sequence has its own, and whether it has one sign."""
        entry = self.of.effects[column.effect].entry
        low, high = (BEYOND * each for each in entry.parameters[column.parameter].plausible)
        return (-np.inf, np.inf, False) if entry.scope.own else (low, high, low == 0.0 or high == 0.0)

    def _sequences(self, effect: int) -> dict[int, NDArray[np.int64]] | None:
        """Rows of an effect with values of every sequence, by sequence; ``None`` for others."""
        if not self.of.effects[effect].entry.scope.own or not len(self._rows[effect]):
            return None
        owner = [self.of.columns[row].sequence for row in self._rows[effect]]
        rows = {s: np.array([r for r, o in zip(self._rows[effect], owner, strict=True) if o == s]) for s in dict.fromkeys(owner)}
        return self._worth_their_start(effect, rows)

    def _worth_their_start(self, effect: int, rows: dict[int, NDArray[np.int64]]) -> dict[int, NDArray[np.int64]]:
        """Where a place is searched for in every sequence, those in which it gains more than the best of as many places by chance."""
        tried = self.of.tried(effect)
        if tried == 1:
            return rows
        some = {s: r for s, r in rows.items() if self._at_least_one(effect, r)}
        gain = {s: 0.5 * float(np.sum(self.of.pull[r] ** 2 / np.diag(self.of.information)[r])) for s, r in some.items()}
        least = min(np.log(tried * len(rows)), max(gain.values(), default=0.0))
        return {s: r for s, r in some.items() if gain[s] >= least}

    def _at_least_one(self, effect: int, rows: NDArray[np.int64]) -> bool:
        """Whether what comes in whole numbers is, alone, nearer to one than to none: what is missing is not less than nothing."""
        of = self.of.effects[effect]
        whole = [row for row in rows if of.entry.parameters[self.of.columns[row].parameter].name in of.whole]
        return not whole or any(self.of.pull[r] >= 0.5 * self.of.information[r, r] for r in whole)

    def rows(self, effect: int) -> NDArray[np.int64]:
        """Columns of an effect that are in use: of a searched place those of sequences in which it was worth the search."""
        return self._rows[effect]

    def sized(self, members: Sequence[int]) -> list[int]:
        """Those of a set that act and have columns in use."""
        return [e for e in self.acting(members) if len(self._rows[e])]

    def acting(self, members: Sequence[int]) -> list[int]:
        """Those of a set that do something beside the others: a wind where something feels it, a wrong spin where something acts by it."""
        effects = [self.of.effects[e] for e in members]
        return [e for e in members if not idle(self.of.effects[e], effects)]

    def within_bounds(self, effect: int, amplitudes: Array) -> bool:
        """Whether ``amplitudes`` (q,) of an effect's columns, in the units of their parameters, are within twice the plausible range."""
        low, high, _ = self._bounds[:, self._rows[effect]]
        return bool(np.all((low <= amplitudes) & (amplitudes <= high)))

    def limits(self, effect: int) -> dict[int, float]:
        """What the scales of an effect's prior are multiplied by, by parameter."""
        parameters = [self.of.columns[row].parameter for row in self._rows[effect]]
        return dict(zip(parameters, self._limits[effect].tolist(), strict=True))

    def log_evidence(self, members: Sequence[int]) -> float:
        """Logarithm (nats) of the marginal likelihood of a set, up to what all sets share."""
        return self.scaled(members).log_evidence

    def scaled(self, members: Sequence[int]) -> Scaled:
        """A set with every effect's scale summed over, one after the other about the most probable ones."""
        key = tuple(sorted(members))
        if key not in self.known:
            self.known[key] = self._scaled(key)
        return self.known[key]

    def fitted(self, members: Sequence[int]) -> Fitted:
        """A set with the posterior of its amplitudes, at the most probable scales."""
        scaled = self.scaled(members)
        sized = self.sized(scaled.members)
        at = self._at(sized, scaled.scales)
        noise, out = self._noise_model.at(at.shared.misfit), self._parts_of(tuple(sized)).out
        rows, mean, variance = at.few, at.shared.mean, np.diag(at.shared.covariance)
        if out is not None:
            rows, mean = np.concatenate([rows, out.rows]), np.concatenate([mean, out.limits * at.own])
            variance = np.concatenate([variance, out.limits**2 * at.spread])
        fit = self.of.misfit - 2.0 * float(self.of.pull[rows] @ mean) + float(mean @ self.of.information[np.ix_(rows, rows)] @ mean)
        log_likelihood = self._log_density(max(fit, 0.0)) + sum(self.of.gain(e) for e in scaled.members)
        log_likelihood += log_share_inside(self._bounds[:, at.few], at.shared, noise)
        return Fitted(scaled, log_likelihood, rows, mean, np.sqrt(noise * variance), noise)

    def precisions(self, members: Sequence[int]) -> Array:
        """Information (q,) that the priors of a set give, by the rows of :meth:`fitted`."""
        scaled = self.scaled(members)
        sized = self.sized(scaled.members)
        precision, parts = np.zeros(len(self.of.columns)), self._parts_of(tuple(sized))
        for e, scale in zip(sized, scaled.scales, strict=True):
            precision[self._rows[e]] = (scale * self._limits[e]) ** -2.0
        return precision[parts.few if parts.out is None else np.concatenate([parts.few, parts.out.rows])]

    def _scaled(self, members: tuple[int, ...]) -> Scaled:
        """Climb to the most probable scales; of each effect's scales the best and its neighbours are summed, the others hardly count."""
        sized = self.sized(members)
        at = [self._hint.get(e, len(self._scales[e]) // 2) for e in sized]
        seen: dict[tuple[int, ...], float] = {}

        def value(where: Sequence[int]) -> float:
            key = tuple(where)
            if key not in seen:
                seen[key] = self._at(sized, [float(self._scales[e][j]) for e, j in zip(sized, key, strict=True)]).value
            return seen[key]

        climbing = True
        while climbing:
            climbing = False
            for i, e in enumerate(sized):
                for j in self._beside(e, at[i]):
                    there = [*at[:i], j, *at[i + 1 :]]
                    if value(there) > value(at):
                        at, climbing = there, True
        peak, width = value(at), 0.0
        for i, e in enumerate(sized):
            around = [peak, *(value([*at[:i], j, *at[i + 1 :]]) for j in self._beside(e, at[i]))]
            width += float(np.logaddexp.reduce(around)) - peak - float(np.log(len(self._scales[e])))
        self._hint.update(zip(sized, at, strict=True))
        total = peak + width + sum(self.of.gain(e) - LOG_SCALES * self.of.effects[e].random for e in members)
        return Scaled(members, float(total), tuple(float(self._scales[e][j]) for e, j in zip(sized, at, strict=True)))

    def _beside(self, effect: int, place: int) -> list[int]:
        return [j for j in (place - 1, place + 1) if 0 <= j < len(self._scales[effect])]

    def _at(self, sized: Sequence[int], scales: Sequence[float]) -> _At:
        """A set at given scales of its effects' priors."""
        scale, known = dict(zip(sized, scales, strict=True)), self._parts_of(tuple(sized))
        sigma = np.concatenate([np.zeros(0), *(scale[e] * self._limits[e] for e in known.of_few)])
        if known.out is None:
            shared, values, spread, tails = posterior(self._whole.take(known.few), sigma), np.zeros(0), np.zeros(0), 0.0
        else:
            effects = [e for e, _ in known.groups]
            student = Student(np.array([scale[e] for e in effects]), np.array([self.of.effects[e].freedom for e in effects]))
            found, tails = with_tails(known.out, student, sigma, self._noise_model)
            shared, values, spread = found.few, found.own, found.spread
        noise = self._noise_model.at(shared.misfit)
        value = self._log_density(shared.misfit) - shared.half_log_det + tails
        return _At(value + log_share_inside(known.bounds, shared, noise) - known.searched, known.few, shared, values, spread)

    def _parts_of(self, sized: tuple[int, ...]) -> _Parts:
        """What of a set is the same at all scales."""
        if sized not in self._parts:
            own = {e: self._own[e] or {} for e in sized if self._own[e]}
            of_few = tuple(e for e in sized if e not in own)
            few = np.concatenate([np.zeros(0, dtype=np.int64), *(self._rows[e] for e in of_few)])
            groups = tuple(sorted(((e, s) for e, rows in own.items() for s in rows), key=lambda group: (group[1], group[0])))
            if own and tuple(own) not in self._apart:
                limits = np.zeros(len(self.of.columns))
                for e in own:
                    limits[self._rows[e]] = self._limits[e]
                self._apart[tuple(own)] = Own.of(self._whole, tuple(own[e][s] for e, s in groups), np.array([s for _, s in groups]), limits)
            out = self._apart[tuple(own)].beside(few) if own else None
            self._parts[sized] = _Parts(of_few, few, groups, out, self._bounds[:, few], self._searched(sized))
        return self._parts[sized]

    def _log_density(self, misfit: float) -> float:
        """Logarithm of the density of a sum of squares: Student's, of every sequence or of all together."""
        if self.of.count is None:
            return self.of.residuals.log_density(misfit)
        return -0.5 * (NOISE_FREEDOM + self.of.count) * float(np.log1p(max(misfit, 0.0) / NOISE_FREEDOM))

    def _searched(self, sized: Sequence[int]) -> float:
        """Logarithm of how many starts were tried where the best was taken, of every sequence that has its own."""
        among = {e: len({c.sequence for c in self.of.columns if c.effect == e}) for e in sized if self.of.tried(e) > 1}
        return sum(max(len(self._own[e] or {}), 1) * float(np.log(self.of.tried(e) * n)) for e, n in among.items())
