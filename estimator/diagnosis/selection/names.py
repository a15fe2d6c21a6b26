"""One number with several names: what it is under each, and what its other names leave open of everything fitted.

A group of an effect that was found and of what may stand in its place has a value under every name (:mod:`.groups`). As long as nothing
settles the group, the model with the first name may be wrong: with the probability ``w`` of another name, its share of the group's, the
other effect has the value that it has in the set with it in the first one's place. About none, where the fit has it, its variance is
``w (mean² + sigma²)``, and what the fit makes of that is for consider covariance to say (:mod:`estimator.fitting.considered`). That is the
variance over the models of the group [Hoeting et al. 1999, Bayesian model averaging], in their linear neighbourhood. So it is for an effect
that the data neither show nor exclude, beside all that was found.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from datasets.vocabulary.effects import Parameter, Scope
from estimator.diagnosis.selection.groups import FACTOR, Name
from estimator.diagnosis.selection.path import At
from estimator.diagnosis.selection.search import Set
from estimator.fitting.considered import Possible

Array = NDArray[np.float64]


@dataclass(frozen=True)
class UnderName:
    """A group's number under one of its names.

    ``key`` of the effect, its ``probability`` among the group's names, and ``parameters`` with their values ``mean`` (q,) and standard
    deviations ``sigma`` (q,); none where the effect has no amplitudes shared by all sequences.
    """

    key: str
    probability: float
    parameters: tuple[Parameter, ...]
    mean: Array
    sigma: Array


def under_names(at: At, members: Set, group: Sequence[Name]) -> tuple[UnderName, ...]:
    """What a group of the effect ``group[0]`` of a set is under each of its names."""
    log_odds = np.array([name.log_odds for name in group])
    weight = np.exp(log_odds - log_odds.max())
    found = []
    for name, share in zip(group, weight / weight.sum(), strict=True):
        exchanged = tuple(sorted((*(e for e in members if e != group[0].effect), name.effect)))
        found.append(_under(at, exchanged, name.effect, float(share)))
    return tuple(found)


def _under(at: At, members: Set, effect: int, probability: float) -> UnderName:
    of, fitted = at.trial.evidence.of, at.trial.evidence.fitted(members)
    here = [i for i, row in enumerate(fitted.rows) if of.columns[row].effect == effect and of.columns[row].sequence is None]
    parameters = of.effects[effect].entry.parameters
    named = tuple(parameters[of.columns[fitted.rows[i]].parameter] for i in here)
    return UnderName(of.effects[effect].entry.key, probability, named, fitted.mean[here], fitted.sigma[here])


def possible_names(at: At, groups: Sequence[Sequence[UnderName]], model: Sequence[str]) -> tuple[Possible, ...]:
    """What may be true beside a ``model``: other names of what it has, and effects that are neither shown nor excluded."""
    found: dict[str, Possible] = {}
    for name in (*(name for group in groups for name in group[1:]), *_additions(at)):
        if name.key not in found and name.key not in model and len(name.mean):
            found[name.key] = _possible(at, name)
    return tuple(found.values())


def _additions(at: At) -> list[UnderName]:
    """Effects that the set may have, too: with odds of 1 to ``FACTOR`` or more."""
    found = []
    for effect in set(range(len(at.trial.evidence.of.effects))) - set(at.members) - at.trial.families:
        wider = tuple(sorted((*at.members, effect)))
        odds = at.trial.log_posterior(wider) - at.value
        if odds >= -np.log(FACTOR) and at.trial.evidence.of.effects[effect].entry.scope is not Scope.SEQUENCE:
            found.append(_under(at, wider, effect, float(expit(odds))))
    return sorted(found, key=lambda name: -name.probability)


def _possible(at: At, name: UnderName) -> Possible:
    """A name as an effect that may be there with its probability."""
    (effect,) = [e for e in at.trial.evidence.of.effects if e.entry.key == name.key]
    covariance = np.zeros((len(effect.entry.parameters),) * 2)
    place = [effect.entry.names.index(p.name) for p in name.parameters]
    covariance[np.ix_(place, place)] = name.probability * (np.outer(name.mean, name.mean) + np.diag(name.sigma**2))
    return Possible(effect.held_by(None), covariance)
