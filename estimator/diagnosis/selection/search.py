"""One search over sets of effects: add, take out, exchange, two at once; a beam of the most probable sets.

A set's prior is a product: every effect of the catalogue is in the model with the same small probability, and so is, with less, an
empirical family ("something unknown"), one of them at a time.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.special import logsumexp

from estimator.diagnosis.selection.evidence import Evidence

EXPECTED = 0.5
"""Effects of the catalogue that are expected to be missing of a campaign, before it is looked at (decision 47)."""
UNKNOWN = 0.05
"""Probability that something is missing that no effect of the catalogue is, before it is looked at (decision 47)."""
BEAM = 3
"""Sets that are kept side by side. By judgement."""
MOST = 6
"""Members of a set. By judgement: what needs more is nothing that the catalogue describes."""
PAIRS = 8
"""Effects of which all pairs are looked at: those that alone explain most, of all or in the place of one that is there (notebook 49)."""
Set = tuple[int, ...]


@dataclass(frozen=True)
class Posterior:
    """Sets by descending log posterior (nats), normalised over all sets that were looked at."""

    sets: tuple[Set, ...]
    log_probability: tuple[float, ...]

    @property
    def best(self) -> Set:
        """The most probable set."""
        return self.sets[0]

    def probability(self, effect: int) -> float:
        """Of an effect to be in the model."""
        return self._of(lambda each: effect in each)

    def more_than(self, members: Set) -> float:
        """Probability of more effects than those of a set: what may be exchanged for one of them is not one more."""
        return self._of(lambda each: len(each) > len(members))

    def _of(self, holds: Callable[[Set], bool]) -> float:
        """Probability of the sets for which something ``holds``."""
        return float(min(sum(np.exp(p) for each, p in zip(self.sets, self.log_probability, strict=True) if holds(each)), 1.0))


@dataclass(frozen=True)
class Overrated:
    """A step from the fitted set that a refit refused: effects ``added``, ``removed``, ``kept``; ``by`` how many nats it was overrated."""

    added: frozenset[int]
    removed: frozenset[int]
    kept: frozenset[int]
    by: float

    def of(self, members: Set) -> float:
        """What a set is overrated by.

        An addition counts beside all that was fitted, a removal where nothing is added, an exchange wherever it is made.
        """
        held = set(members)
        if not self.added:
            there = held <= self.kept
        else:
            there = self.added <= held and not self.removed & held and bool(self.removed or self.kept <= held)
        return self.by if there else 0.0


@dataclass(frozen=True)
class Trial:
    """What is searched.

    ``evidence``; ``families``: which of its effects are empirical ones; where a search has gone on from here, steps that refits refused,
    ``overrated``, and the set that was ``fitted``: one that never was counts no more than that.
    Effects that are ``noise`` are in every set.
    """

    evidence: Evidence
    families: frozenset[int]
    overrated: tuple[Overrated, ...] = ()
    fitted: Set | None = None
    noise: frozenset[int] = frozenset()

    @cached_property
    def _prior(self) -> tuple[float, float]:
        """Log prior odds of an effect of the catalogue and of a family to be missing."""
        wide = len(self.families)
        known = len(self.evidence.of.effects) - wide - len(self.noise)
        return float(np.log(EXPECTED / max(known, 1))), float(np.log(UNKNOWN / max(wide, 1)))

    def log_posterior(self, members: Set) -> float:
        """Up to what all sets share (nats); minus infinity of one without the noise, or with two families."""
        if not self.noise <= set(members) or len(self.families & set(members)) > 1:
            return -np.inf
        value = self.linear(members) - max((each.of(members) for each in self.overrated), default=0.0)
        return value if self.fitted is None else min(value, self.linear(self.fitted))

    def linear(self, members: Set) -> float:
        """What the linearised campaign says."""
        unknown = sum(e in self.families for e in members)
        known, wide = self._prior
        return (len(members) - unknown) * known + unknown * wide + self.evidence.log_evidence(members)

    def allowed(self, members: Set) -> bool:
        """Whether a set is one of those that compete."""
        return len(set(members) - self.noise) <= MOST and len(self.families & set(members)) <= 1


def searched(trial: Trial, start: Set = ()) -> Posterior:
    """The posterior over sets, from ``start`` and from nothing."""
    n = range(len(trial.evidence.of.effects))
    beam = {(), tuple(sorted(start))} if start else _best(trial, {(), *_pairs(trial, n)})
    while True:
        wider = _best(trial, {new for old in beam for new in _neighbours(old, n) if trial.allowed(new)} | beam)
        if wider == beam:
            break
        beam = wider
    return posterior_of(trial)


def posterior_of(trial: Trial) -> Posterior:
    """The posterior over all sets that were looked at, the fitted one first among equals."""
    values = {each: trial.log_posterior(each) for each in trial.evidence.known}
    ordered = sorted(values, key=lambda each: (-values[each], each != trial.fitted))
    every = np.array([values[each] for each in ordered])
    return Posterior(tuple(ordered), tuple(float(p) for p in every - logsumexp(every)))


def try_pairs(trial: Trial, members: Set) -> None:
    """Work out the sets in which two effects stand for one of ``members``, those that do best there alone; the posterior then has them."""
    for out in members:
        kept = tuple(e for e in members if e != out)
        others = [e for e in range(len(trial.evidence.of.effects)) if e not in members]
        alone = sorted(others, key=lambda e: trial.log_posterior(tuple(sorted((*kept, e)))), reverse=True)
        for pair in combinations(alone[:PAIRS], 2):
            if trial.allowed((*kept, *pair)):
                trial.log_posterior(tuple(sorted((*kept, *pair))))


def _pairs(trial: Trial, n: range) -> Iterator[Set]:
    """Pairs of the effects that alone explain most: two may show only together."""
    singles = sorted(((e,) for e in n), key=trial.log_posterior, reverse=True)
    for pair in combinations((e for (e,) in singles[:PAIRS]), 2):
        if trial.allowed(pair):
            yield tuple(sorted(pair))


def _best(trial: Trial, sets: set[Set]) -> set[Set]:
    """The most probable ones; among equals always the same ones, or beams of equals would take turns for ever."""
    return set(sorted(sets, key=lambda each: (-trial.log_posterior(each), each))[:BEAM])


def _neighbours(members: Set, n: range) -> Iterator[Set]:
    """With one effect more, one less, or one in another's place."""
    others = [e for e in n if e not in members]
    for e in others:
        yield tuple(sorted((*members, e)))
    for out in members:
        kept = tuple(e for e in members if e != out)
        yield kept
        for e in others:
            yield tuple(sorted((*kept, e)))
