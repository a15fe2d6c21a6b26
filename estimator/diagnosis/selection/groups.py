"""Which effects the data cannot tell from one of a set: what would look the same in its place.

A name of an effect that was found is what a nearly as probable set has instead of it: another effect, two together, or something unknown.
What such a set has instead must be of use there (without any of it, the set is less probable), and the effect itself must not be (put back,
it makes the set no more probable).

Confounding is read off the information, not off a list. Of the fitted signature of an effect, another effect that is put in its place can
make up a part; what it cannot is the squared sine of the principal angle between the signature and the other's columns, with all else
re-adjusted [Björck and Golub 1973], times the signature's chi-squared. Where that is less than chance may make, the two are one number
with two names. Prior ranges still say which name is the more probable one.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logsumexp

from estimator.diagnosis.selection.search import Set, Trial
from estimator.fitting.stable_inverse import stable_inverse

Array = NDArray[np.float64]
FACTOR = 20.0
"""Of likelihood, or of posterior probability, within which two effects cannot be distinguished: strong evidence [Kass and Raftery 1995]."""
LEAST_ODDS = -2.0 * float(np.log(FACTOR))
"""Logarithm of the odds below which a set does not count against an effect (notebook 49)."""
MOST_NAMED = 5
"""Members of a group that are named; of more that do as well the most probable."""


@dataclass(frozen=True)
class Name:
    """One name of a group: the numbers of its ``effects``, one as a rule, in the set ``members`` that has them in the first one's place.

    ``log_odds`` (nats) of that set against the set as it is.
    """

    effects: Set
    members: Set
    log_odds: float


def group_of(trial: Trial, members: Set, effect: int) -> tuple[Name, ...]:
    """The effect first, then what may stand in its place, the most probable first."""
    trial, found = replace(trial, fitted=None), dict[Set, Name]()
    for name in sorted((*_alike(trial, members, effect), *_as_probable(trial, members, effect)), key=lambda name: -name.log_odds):
        found.setdefault(name.effects, replace(name, log_odds=min(name.log_odds, 0.0)))
    least = [name for name in found.values() if not any(set(other) < set(name.effects) for other in found)]
    return (Name((effect,), members, 0.0), *least)[:MOST_NAMED]


def sureness(trial: Trial, members: Set, effect: int, most: float = np.inf) -> float:
    """Probability, 0 to 1, that an effect of a set or something in its place is missing, not sets with neither; ``most``: log odds."""
    trial = replace(trial, fitted=None)
    some, none = [-np.inf], [-np.inf]
    for other in list(trial.evidence.known):
        odds = _odds(trial, other, members)
        if odds > LEAST_ODDS:
            (some if effect in other or _in_place(trial, other, effect) else none).append(odds)
    return float(expit(min(logsumexp(some) - logsumexp(none), most)))


def _alike(trial: Trial, members: Set, effect: int) -> Iterator[Name]:
    """Single effects that make up for it in likelihood, whatever their priors say, with amplitudes within twice the plausible range."""
    kept = tuple(e for e in members if e != effect)
    for other in range(len(trial.evidence.of.effects)):
        exchanged = tuple(sorted((*kept, other)))
        if other in members or not trial.allowed(exchanged):
            continue
        odds = _odds(trial, exchanged, members)
        wide = other in trial.families or trial.evidence.of.effects[other].entry.scope.own
        if wide or other not in trial.evidence.sized(exchanged) or not np.isfinite(odds):
            continue
        lost, regained, amplitude = exchange(trial, members, effect, other)
        if lost <= np.log(FACTOR) <= regained and trial.evidence.within_bounds(other, amplitude):
            yield Name((other,), exchanged, odds)


def _as_probable(trial: Trial, members: Set, effect: int) -> Iterator[Name]:
    """What nearly as probable sets without the effect have in its place, that the set lacks."""
    for other in list(trial.evidence.known):
        new = tuple(e for e in other if e not in members)
        odds = _odds(trial, other, members)
        if effect in other or not new or odds < -np.log(FACTOR):
            continue
        if _of_use(trial, other, new) and _in_place(trial, other, effect):
            yield Name(new, other, odds)


def _odds(trial: Trial, one: Set, other: Set) -> float:
    return float(trial.log_posterior(one) - trial.log_posterior(other))


def _of_use(trial: Trial, members: Set, new: Set) -> bool:
    """Whether a set is less probable without any of ``new``."""
    return all(_odds(trial, tuple(e for e in members if e != each), members) < 0.0 for each in new)


def _in_place(trial: Trial, other: Set, effect: int) -> bool:
    """Whether a set without an effect has something in its place: put back, the effect is of no use there."""
    return trial.log_posterior(tuple(sorted((*other, effect)))) <= trial.log_posterior(other)


def exchange(trial: Trial, members: Set, effect: int, other: int) -> tuple[float, float, Array]:
    """Log likelihood (nats) that is lost where ``other`` stands for the fitted ``effect`` of a set, and what more is lost without either.

    Both are free, all else is re-adjusted. Last the amplitudes (q,) that ``other`` has there.
    """
    of, fitted = trial.evidence.of, trial.evidence.fitted(members)
    first, second = trial.evidence.rows(effect), trial.evidence.rows(other)
    here = np.concatenate([first, second])
    kept = np.isin(fitted.rows, first, invert=True)
    beside, prior = fitted.rows[kept], trial.evidence.precisions(members)[kept]
    cross = of.information[np.ix_(beside, here)]
    G = of.information[np.ix_(here, here)] - cross.T @ stable_inverse(of.information[np.ix_(beside, beside)] + np.diag(prior)) @ cross
    k = len(first)
    stands_for = stable_inverse(G[k:, k:], 1e-10) @ G[k:, :k]
    made_up = G[:k, k:] @ stands_for
    theta = fitted.mean[~kept]
    lost, regained = (float(0.5 * theta @ each @ theta / fitted.noise) for each in (G[:k, :k] - made_up, made_up))
    return lost, regained, np.asarray(stands_for @ theta)
