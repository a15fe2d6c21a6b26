"""One number with several names: what it is under each, and what its other names leave open of everything fitted.

A group of an effect that was found and of what may stand in its place has a value under every name (:mod:`.groups`). As long as nothing
settles the group, the model with the first name may be wrong: with the probability ``w`` of another name, its share of the group's, the
other effect has the value that it has in the set with it in the first one's place. About none, where the fit has it, its variance is
``w (mean² + sigma²)``, and what the fit makes of that is for consider covariance to say (:mod:`estimator.fitting.considered`). That is the
variance over the models of the group [Hoeting et al. 1999, Bayesian model averaging], in their linear neighbourhood.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Parameter, Scope
from estimator.diagnosis.selection.groups import Name
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
    """The other names of all groups as possible effects beside a ``model`` that has the first ones."""
    effects = {e.entry.key: e for e in at.trial.evidence.of.effects}
    found: dict[str, Possible] = {}
    for name in (name for group in groups for name in group[1:]):
        effect = effects[name.key]
        if name.key in model or name.key in found or effect.entry.scope is Scope.SEQUENCE or not len(name.mean):
            continue
        covariance = np.zeros((len(effect.entry.parameters),) * 2)
        place = [effect.entry.names.index(p.name) for p in name.parameters]
        covariance[np.ix_(place, place)] = name.probability * (np.outer(name.mean, name.mean) + np.diag(name.sigma**2))
        found[name.key] = Possible(effect.held_by(None), covariance)
    return tuple(found.values())
