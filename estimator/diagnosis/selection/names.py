"""One number with several names: what it is under each, and what its other names leave open of everything fitted.

A group of an effect that was found and of what may stand in its place has a value under every name (:mod:`.groups`), beside all that the
set has in which it is judged: what is unknown, and what is not established, would be in the values without.

As long as nothing settles the group, the model with the first name may be wrong: with the probability ``w`` of another name, its share of
the group's, the other effect has the value that it has in the set with it in the first one's place. About none, where the fit has it, its
variance is ``w (mean² + sigma²)``, and what the fit makes of that is for consider covariance to say
(:mod:`estimator.fitting.campaigns.considered`). That is the variance over the models of the group [Hoeting et al. 1999, Bayesian model
averaging], in their linear neighbourhood. So it is for an effect that the data neither show nor exclude, beside all that was found.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logsumexp

from datasets.vocabulary.effects import Parameter
from estimator.diagnosis.selection.groups import FACTOR, Name
from estimator.diagnosis.selection.path import At, moved
from estimator.diagnosis.selection.search import Set
from estimator.fitting.campaigns.considered import Possible, Uncertain

Array = NDArray[np.float64]
JOINED = "+"
"""Between the keys of a name that is two effects together."""


@dataclass(frozen=True)
class Part:
    """An effect of a name: its ``key`` and ``parameters`` with values ``mean`` (q,) and standard deviations ``sigma`` (q,).

    None where the effect has no amplitudes shared by all sequences.
    """

    key: str
    parameters: tuple[Parameter, ...]
    mean: Array
    sigma: Array


@dataclass(frozen=True)
class UnderName:
    """A group's number under one of its names: the name's ``parts``, one effect as a rule, and its ``probability`` among the names.

    ``unknown``: whether one of the parts is no effect of the catalogue, but an empirical family; ``log_odds`` (nats) of the set with it
    against the set as it is.
    """

    parts: tuple[Part, ...]
    probability: float
    unknown: bool = False
    log_odds: float = 0.0

    @property
    def key(self) -> str:
        """The parts' keys."""
        return JOINED.join(part.key for part in self.parts)


def key_of(at: At, name: Name) -> str:
    """What a name is called: its effects' keys."""
    return JOINED.join(at.named(name.effects))


def under_names(at: At, group: Sequence[Name]) -> tuple[UnderName, ...]:
    """What a group is under each of its names: in the set where it was found, and in fits with another name in the first one's place.

    A name that its own fit refutes is left out.
    """
    fits = [_fitted(at, name) for name in group]
    stand = [(fit, there) for fit, there in fits if not _refuted(at, fit)]
    log_odds = np.array([there.log_odds for _, there in stand])
    shares = np.exp(log_odds - logsumexp(log_odds)).tolist()
    return tuple(_under(fit, there, share) for (fit, there), share in zip(stand, shares, strict=True))


def _fitted(at: At, name: Name) -> tuple[At, Name]:
    """A fit with a name in the first one's place, and the name there; where the group is if that has the name, or flights run away."""
    acting = at.trial.evidence.acting(name.members)
    of = {effect.entry.key: effect.held_by(None) for effect in (at.trial.evidence.of.effects[e] for e in at.members)}
    fit = None if name.members == at.members else moved(at, name.members, of, unknown=(*at.keys, *at.named(name.members)))
    if fit is None:
        return at, name
    return fit, replace(name, effects=tuple(map(acting.index, name.effects)), members=fit.members)


def _refuted(at: At, fit: At) -> bool:
    """Whether a fit with another name loses to the one with the first, or to that in its place there, likelihood and evidence alike.

    A name stands for an effect in the linear neighbourhood of that fit; how far that reaches only a fit says. Two fits are compared where
    the likelihood is one of the rows, not of scores, which differ with what is on trial.
    """
    of = fit.trial.evidence.of
    if fit is at or not set(at.keys) <= set(of.keys):
        return False
    others = [_worth(fit, tuple(sorted(map(of.keys.index, at.keys)))), *([_worth(at, at.members)] if of.count is None else [])]
    return any(bool(np.all(other - _worth(fit, fit.members) > np.log(FACTOR))) for other in others)


def _worth(at: At, members: Set) -> Array:
    """Log likelihood and log evidence (2,) of a set, nats."""
    evidence = at.trial.evidence
    return np.array([evidence.fitted(members).log_likelihood, evidence.log_evidence(members)])


def widened(group: Sequence[UnderName], of: Uncertain) -> tuple[UnderName, ...]:
    """A group whose values are as much wider as those of its first name are that the fit has, by what is stated of what it lacks."""
    keys = [part.key for part in group[0].parts]
    if not set(keys) <= set(of.fit.model.keys):
        return tuple(group)
    columns = of.fit.model.layout.columns(keys)
    wide, plain = (np.diag(each.of(0, columns)) for each in (of.of_values, of.at.plain))
    times = float(np.sqrt(np.max(wide[plain > 0.0] / plain[plain > 0.0], initial=1.0)))
    return tuple(replace(name, parts=tuple(replace(part, sigma=times * part.sigma) for part in name.parts)) for name in group)


def _under(at: At, name: Name, probability: float) -> UnderName:
    unknown = bool(set(name.effects) & at.trial.families)
    return UnderName(tuple(_part(at, name.members, effect) for effect in name.effects), probability, unknown, name.log_odds)


def _part(at: At, members: Set, effect: int) -> Part:
    of, fitted = at.trial.evidence.of, at.trial.evidence.fitted(members)
    here = [i for i, row in enumerate(fitted.rows) if of.columns[row].effect == effect and of.columns[row].sequence is None]
    parameters = of.effects[effect].entry.parameters
    named = tuple(parameters[of.columns[fitted.rows[i]].parameter] for i in here)
    return Part(of.effects[effect].entry.key, named, fitted.mean[here], fitted.sigma[here])


def possible_names(at: At, groups: Sequence[Sequence[UnderName]]) -> tuple[Possible, ...]:
    """What may be true beside a set: other names of what it has, and what is neither shown nor excluded; each under its first name."""
    other = (name for group in groups if group[0].key in at.keys for name in group[1:] if not name.unknown)
    found: dict[str, Possible] = {}
    for name in (*other, *_additions(at)):
        for part in name.parts:
            if part.key not in found and part.key not in at.keys and len(part.mean):
                found[part.key] = _possible(at, part, name.probability)
    return tuple(found.values())


def _additions(at: At) -> list[UnderName]:
    """Effects that the set may have, too: with odds of 1 to ``FACTOR`` or more."""
    found = []
    for effect in set(range(len(at.trial.evidence.of.effects))) - set(at.members) - at.trial.families:
        wider = tuple(sorted((*at.members, effect)))
        odds = at.trial.log_posterior(wider) - at.value
        if odds >= -np.log(FACTOR) and not at.trial.evidence.of.effects[effect].entry.scope.own:
            found.append(_under(at, Name((effect,), wider, float(odds)), float(expit(odds))))
    return sorted(found, key=lambda name: -name.probability)


def left_out(at: At, model: Sequence[str]) -> list[UnderName]:
    """What the most probable set has beside a ``model``: something unknown, and what is not established beside it."""
    without = (e for e in at.trial.evidence.acting(at.members) if at.trial.evidence.of.effects[e].entry.key not in model)
    return [_under(at, Name((e,), at.members, 0.0), at.posterior.probability(e)) for e in without]


def _possible(at: At, part: Part, probability: float) -> Possible:
    """A part of a name as an effect that may be there with a probability."""
    (effect,) = [e for e in at.trial.evidence.of.effects if e.entry.key == part.key]
    covariance = np.zeros((len(effect.entry.parameters),) * 2)
    place = [effect.entry.names.index(p.name) for p in part.parameters]
    covariance[np.ix_(place, place)] = probability * (np.outer(part.mean, part.mean) + np.diag(part.sigma**2))
    return Possible(effect.held_by(None), covariance)
