"""Which effects the data cannot tell from one of a set: what does as well in its place.

Confounding is read off the likelihood, not off a list: an effect is an alias of another where the set with the one exchanged for the other
is as likely to within a factor, or as probable. Where the spans of both effects' signatures share a direction along the fitted
amplitudes, the likelihoods are equal (a principal angle of zero between columns of the Fisher information [Björck and Golub 1973]);
prior ranges then still say which is the more probable name.
"""

from dataclasses import dataclass

import numpy as np

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.selection.search import Set, Trial

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
    own, likely = trial.log_posterior(members), trial.evidence.fitted(members).log_likelihood
    found = []
    for other in range(len(trial.evidence.of.effects)):
        if other in members or other in trial.families:
            continue
        exchanged = tuple(sorted((*(e for e in members if e != effect), other)))
        odds = trial.log_posterior(exchanged) - own
        wide = trial.evidence.of.effects[other].entry.scope is Scope.SEQUENCE
        alike = not wide and trial.evidence.fitted(exchanged).log_likelihood >= likely - np.log(FACTOR)
        if odds >= -np.log(FACTOR) or alike:
            found.append(Name(other, float(odds)))
    found.sort(key=lambda name: -name.log_odds)
    return (Name(effect, 0.0), *found)[:MOST_NAMED]
