"""The marginal likelihood of a set of effects: what the data say of the set, whatever the values of its parameters.

Given the quadratic of :class:`estimator.diagnosis.selection.linearised.Linearised` and a normal prior of covariance ``s² D²`` on the
amplitudes of a set, with ``s²`` the noise's variance over what its model says, the integral over amplitudes and ``s²`` is exact:
``ln p = -1/2 ln det(1 + D G D) - (nu + n)/2 ln(1 + Q / nu)``, ``Q = S(0) - bᵀ D (1 + D G D)⁻¹ D b`` [O'Hagan and Forster 2004,
ch. 11]. ``s²`` has a scaled inverse chi-squared prior of ``nu`` degrees of freedom about 1: the noise model may be wrong by a factor, and a
misfit that no set removes counts as noise.

``D`` is not one number. What nature calls plausible spans orders of magnitude, and an effect of a hundredth of its range is no surprise:
each effect's prior is a mixture of normal ones, of standard deviation ``r`` times its plausible limit with ``r`` uniform in its logarithm
(a scale mixture; [Gelman 2006] for the scatter of values of every sequence, where the same ``r`` is what the scatter is).
Amplitudes that cannot be negative have half of that prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.selection.linearised import Linearised
from estimator.diagnosis.selection.reduced import Posterior, Quadratic, posterior, without

Array = NDArray[np.float64]
NOISE_FREEDOM = 10.0
"""``nu``: the noise's standard deviation is known to about 20%."""
SHARES = 0.5 * np.logspace(-3.0, 0.0, 7)
"""``r``: standard deviations of the prior over the plausible limit, which is two of the widest; an effect of a thousandth of its range is
none."""
UNITS = np.logspace(0.0, 3.0, 7)
"""For amplitudes without a plausible limit: standard deviations of the prior over what the data could just see."""
BEYOND = 2.0
"""Plausible limits up to which an amplitude is believed at all: signatures are linear no further, and nature hardly goes there."""
WIDE = 12
"""Columns beyond which an effect is integrated out once for all sets that have it."""
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
    and ``covariance`` (q, q); ``noise``: ``s²``.
    """

    scaled: Scaled
    log_likelihood: float
    rows: NDArray[np.int64]
    mean: Array
    covariance: Array
    noise: float


@dataclass
class Evidence:
    """Marginal likelihoods of sets of effects of one linearised campaign; each is worked out once."""

    of: Linearised
    known: dict[tuple[int, ...], "Scaled"] = field(default_factory=dict)

    def __post_init__(self) -> None:
        effects = range(len(self.of.effects))
        self._rows = [self.of.rows(e) for e in effects]
        self._limits = [self._limit(e) for e in effects]
        self._whole = Quadratic(self.of.information, self.of.pull, self.of.misfit)
        self._reduced: dict[tuple[int, float], Quadratic] = {}
        self._hint: dict[int, int] = {}

    def _limit(self, effect: int) -> Array:
        """Plausible limits (q,) of an effect's columns, or what the data just see where nobody says what is plausible."""
        parameters = self.of.effects[effect].entry.parameters
        limit = np.array([max(map(abs, parameters[self.of.columns[i].parameter].plausible)) for i in self._rows[effect]])
        seen = 1.0 / np.sqrt(np.diag(self.of.information)[self._rows[effect]])
        return np.where(np.isfinite(limit), limit, seen)

    def scales_of(self, effect: int) -> Array:
        """The scales of an effect's prior, over its limits."""
        parameters = self.of.effects[effect].entry.parameters
        return SHARES if all(np.isfinite(p.plausible).all() for p in parameters) else UNITS

    def log_evidence(self, members: Sequence[int]) -> float:
        """Logarithm (nats) of the marginal likelihood of a set, up to what all sets share."""
        return self.scaled(members).log_evidence

    def scaled(self, members: Sequence[int]) -> "Scaled":
        """A set with every effect's scale summed over, one after the other about the most probable ones."""
        key = tuple(sorted(members))
        if key not in self.known:
            self.known[key] = self._scaled(key)
        return self.known[key]

    def fitted(self, members: Sequence[int]) -> Fitted:
        """A set with the posterior of its amplitudes, at the most probable scales."""
        scaled = self.scaled(members)
        sized = [e for e in scaled.members if len(self._rows[e])]
        rows = np.concatenate([np.zeros(0, dtype=np.int64), *(self._rows[e] for e in sized)])
        sigma = np.concatenate([np.zeros(0), *(r * self._limits[e] for e, r in zip(sized, scaled.scales, strict=True))])
        at = posterior(self._whole, rows, sigma)
        noise = self._noise(at.misfit)
        fit = self.of.misfit - 2.0 * float(self.of.pull[rows] @ at.mean)
        fit += float(at.mean @ self.of.information[np.ix_(rows, rows)] @ at.mean)
        log_likelihood = self._log_density(max(fit, 0.0)) + sum(self.of.gain(e) for e in scaled.members)
        log_likelihood += sum(self._inside(e, rows, at, noise) for e in sized)
        return Fitted(scaled, log_likelihood, rows, at.mean, noise * at.covariance, noise)

    def _scaled(self, members: tuple[int, ...]) -> "Scaled":
        """Climb to the most probable scales; of each effect's scales the best and its neighbours are summed, the others hardly count."""
        sized = [e for e in members if len(self._rows[e])]
        at = [self._hint.get(e, len(self.scales_of(e)) // 2) for e in sized]
        seen: dict[tuple[int, ...], float] = {}

        def value(where: Sequence[int]) -> float:
            key = tuple(where)
            if key not in seen:
                seen[key] = self._value(sized, [float(self.scales_of(e)[j]) for e, j in zip(sized, key, strict=True)])
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
            width += float(logsumexp(around)) - peak - float(np.log(len(self.scales_of(e))))
        self._hint.update(zip(sized, at, strict=True))
        total = peak + width + sum(self.of.gain(e) - LOG_SCALES * self.of.effects[e].random for e in members)
        return Scaled(members, float(total), tuple(float(self.scales_of(e)[j]) for e, j in zip(sized, at, strict=True)))

    def _beside(self, effect: int, place: int) -> list[int]:
        return [j for j in (place - 1, place + 1) if 0 <= j < len(self.scales_of(effect))]

    def _value(self, sized: Sequence[int], scales: Sequence[float]) -> float:
        """Log evidence of effects at given scales of their priors, half-sided where amplitudes are."""
        quadratic, few = self._whole, dict(zip(sized, scales, strict=True))
        widest = max(sized, key=lambda e: len(self._rows[e]), default=None)
        if widest is not None and len(self._rows[widest]) > WIDE:
            quadratic = self._without(widest, few.pop(widest))
        rows = np.concatenate([np.zeros(0, dtype=np.int64), *(self._rows[e] for e in few)])
        sigma = np.concatenate([np.zeros(0), *(r * self._limits[e] for e, r in few.items())])
        at = posterior(quadratic, rows, sigma)
        noise = self._noise(at.misfit)
        sided = sum(self._inside(e, rows, at, noise) for e in few)
        return self._log_density(at.misfit) - at.half_log_det + sided - self._searched(sized)

    def _noise(self, misfit: float) -> float:
        """Most probable variance of the noise over what its model says."""
        return 1.0 if self.of.count is None else (NOISE_FREEDOM + misfit) / (NOISE_FREEDOM + self.of.count)

    def _log_density(self, misfit: float) -> float:
        """Logarithm of the density of a sum of squares: normal where the noise is known, Student's where its variance is integrated."""
        if self.of.count is None:
            return self.of.density - 0.5 * misfit
        return -0.5 * (NOISE_FREEDOM + self.of.count) * float(np.log1p(max(misfit, 0.0) / NOISE_FREEDOM))

    def _without(self, effect: int, scale: float) -> Quadratic:
        if (effect, scale) not in self._reduced:
            self._reduced[effect, scale] = without(self._whole, self._rows[effect], scale * self._limits[effect])
        return self._reduced[effect, scale]

    def _inside(self, effect: int, rows: NDArray[np.int64], at: Posterior, noise: float) -> float:
        """Logarithm of the posterior's share that lies where amplitudes can be, over the prior's share where they have one sign only."""
        entry = self.of.effects[effect].entry
        if entry.scope is Scope.SEQUENCE:
            return 0.0
        total = 0.0
        for i, row in enumerate(rows):
            column = self.of.columns[row]
            if column.effect == effect:
                low, high = (BEYOND * each for each in entry.parameters[column.parameter].plausible)
                sigma = float(np.sqrt(noise * at.covariance[i, i]))
                total += _log_share((low - at.mean[i]) / sigma, (high - at.mean[i]) / sigma)
                total += float(np.log(2.0)) * (low == 0.0 or high == 0.0)
        return total

    def _searched(self, sized: Sequence[int]) -> float:
        """Logarithm of how many starts were tried where the best was taken, of every sequence that has its own."""
        total = 0.0
        for e in sized:
            owners = {self.of.columns[row].sequence for row in self._rows[e]}
            total += max(len(owners), 1) * float(np.log(self.of.tried(e)))
        return total


def _log_share(low: float, high: float) -> float:
    """Logarithm of the standard normal distribution's share between two bounds."""
    if low > 0.0:
        low, high = -high, -low
    above, below = float(log_ndtr(high)), float(log_ndtr(low))
    return above + float(np.log1p(-np.exp(min(below - above, -1e-300)))) if below < above else above
