"""Which effects the data cannot tell from one of a set: what would look the same in its place.

Confounding is read off the information, not off a list. Of the fitted signature of an effect, another effect that is put in its place can
make up a part; what it cannot is the squared sine of the principal angle between the signature and the other's columns, with all else
re-adjusted [Björck and Golub 1973], times the signature's chi-squared. Where that is less than chance may make, the two are one number
with two names. Prior ranges still say which name is the more probable one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.selection.search import Set, Trial
from estimator.fitting.stable_inverse import stable_inverse

Array = NDArray[np.float64]
FACTOR = 20.0
"""Of likelihood, or of posterior probability, within which two effects are not told apart: strong evidence [Kass and Raftery 1995]."""
MOST_NAMED = 5
"""Members of a group that are named; of more that do as well the most probable."""


@dataclass(frozen=True)
class Name:
    """One name of a group: the effect's number, and ``log_odds`` (nats) of the set with it against the set as it is."""

    effect: int
    log_odds: float


def group_of(trial: Trial, members: Set, effect: int) -> tuple[Name, ...]:
    """The effect first, then what may stand in its place, the most probable first."""
    own = trial.log_posterior(members)
    found = []
    for other in range(len(trial.evidence.of.effects)):
        if other in members or other in trial.families:
            continue
        exchanged = tuple(sorted((*(e for e in members if e != effect), other)))
        odds = trial.log_posterior(exchanged) - own
        wide = trial.evidence.of.effects[other].entry.scope is Scope.SEQUENCE
        if odds >= -np.log(FACTOR) or (not wide and difference(trial, members, effect, other) <= np.log(FACTOR)):
            found.append(Name(other, float(odds)))
    found.sort(key=lambda name: -name.log_odds)
    return (Name(effect, 0.0), *found)[:MOST_NAMED]


def difference(trial: Trial, members: Set, effect: int, other: int) -> float:
    """Log likelihood (nats) that is lost where ``other`` stands for the fitted ``effect`` of a set, both free, all else re-adjusted."""
    of, fitted = trial.evidence.of, trial.evidence.fitted(members)
    first, second = trial.evidence.rows(effect), trial.evidence.rows(other)
    if not len(first) or not len(second):
        return np.inf
    here = np.concatenate([first, second])
    kept = np.isin(fitted.rows, first, invert=True)
    beside, prior = fitted.rows[kept], trial.evidence.precisions(members)[kept]
    cross = of.information[np.ix_(beside, here)]
    G = of.information[np.ix_(here, here)] - cross.T @ stable_inverse(of.information[np.ix_(beside, beside)] + np.diag(prior)) @ cross
    k = len(first)
    left = G[:k, :k] - G[:k, k:] @ stable_inverse(G[k:, k:], 1e-10) @ G[k:, :k]
    theta = fitted.mean[~kept]
    return float(0.5 * theta @ left @ theta / fitted.noise)
