"""The way to the most probable set of effects: the campaign linearised anew wherever the set changes.

The quadratic of one linearisation compares all sets, but only near the flights it is taken at. So the search moves in steps of one effect
more, or one in another's place; the campaign is refitted with the new set and linearised there, with every effect on trial again, those
of the set too. It ends where no set is more probable than the one that the flights were fitted with.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimator.diagnosis.selection.groups import FACTOR, group_of
from estimator.diagnosis.selection.refitting import evidence_about, held_anew, refitted
from estimator.diagnosis.selection.search import Overrated, Posterior, Set, Trial, posterior_of, searched, try_pairs
from estimator.effects.empirical.families import families
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.weighing_again import UNFLYABLE, relinearised

GAIN = 0.5
"""Log posterior (nats) that a step has to gain: less is no reason to fit again."""
ASTRAY = 3
"""Sets in a row whose fit is less probable than where the search stands, after which it ends there."""
MOST_STEPS = 12
"""Sets that one search may move to: twice as many as it may have members. By judgement."""
IMPOSSIBLE = 1e3
"""Nats by which a set counts as overrated whose flights run away (notebook 49)."""
Told = Callable[[str], None]
Catalogue = Mapping[str, EffectModel]


@dataclass(frozen=True)
class At:
    """Where the search stands: a fitted set, and all sets' evidence about that fit; ``judged``: the posterior, where refits have judged."""

    campaign: Campaign
    fit: CampaignFit
    trial: Trial
    members: Set
    judged: Posterior | None = None

    @cached_property
    def posterior(self) -> Posterior:
        """Over sets, which are searched where the search stands, not where it turns back."""
        return self.judged or searched(self.trial, self.members)

    @property
    def value(self) -> float:
        """Log posterior (nats) of the fitted set about its own fit."""
        return self.trial.log_posterior(self.members)

    @property
    def odds_of_unknown(self) -> float:
        """Logarithm of how much more probable than all others the best set is that has a family."""
        pairs = [(bool(self.trial.families & set(s)), p) for s, p in zip(self.posterior.sets, self.posterior.log_probability, strict=True)]
        return max((p for has, p in pairs if has), default=-np.inf) - max(p for has, p in pairs if not has)

    def value_of(self, keys: tuple[str, ...]) -> float:
        """Log posterior (nats) of another set about this fit; minus infinity where one of its effects is not on trial here."""
        known = self.trial.evidence.of.keys
        if not set(keys) <= set(known):
            return -np.inf
        return self.trial.log_posterior(tuple(sorted({*(known.index(key) for key in keys), *self.trial.noise})))

    @property
    def keys(self) -> tuple[str, ...]:
        """Those of the set that act in it."""
        return self.named(self.trial.evidence.acting(self.members))

    def named(self, members: Sequence[int]) -> tuple[str, ...]:
        """Keys of effects."""
        return tuple(self.trial.evidence.of.keys[e] for e in members)


def looked_at(campaign: Campaign, fit: CampaignFit, catalogue: Catalogue, *, unknown: bool | Collection[str] = False) -> At:
    """The posterior over sets of a ``catalogue`` about a fit; where asked for, of the empirical families, too: of all, or by their keys."""
    every = families([f.x for f in fit.state.flights], [s.setting.times_s for s in campaign.sequences]) if unknown else ()
    wide = {e.entry.key: e for e in every if isinstance(unknown, bool) or e.entry.key in unknown}
    of = (evidence := evidence_about(campaign, fit, {**catalogue, **wide})).of
    noise = frozenset(i for i, effect in enumerate(of.effects) if effect.noise)
    trial = Trial(evidence, frozenset(i for i, key in enumerate(of.keys) if key in wide), noise=noise)
    return At(campaign, fit, trial, tuple(sorted({*range(of.own), *noise})))


def path_from(at: At, catalogue: Catalogue, told: Told) -> tuple[At, ...]:
    """The path from ``at`` to the most probable set; every entry is more probable than the one before, about either fit.

    What is unknown is looked for where no effect of the catalogue makes a set more probable, against all of them again: about surfaces and
    noise of that very set, since those of another one miss by what an unknown would be told for. Where sequences have errors of their own
    beside all that, it is looked for again beside those; from there, where it is alike in all of them, as no such errors are.
    """
    path = _known_alone((at,), catalogue, told)
    path = (*path[:-1], *_climbed(_with_unknown(path[-1], catalogue), catalogue, told, unknown=True, names=False))
    beside = _beside_own_errors(path[-1], catalogue)
    if beside is None:
        return (*path[:-1], *_climbed(path[-1], catalogue, told, unknown=True))
    if set(beside.members) & beside.trial.families:
        return (*path, *_climbed(beside, catalogue, told, unknown=True))
    known = [each for each in path if not set(each.members) & each.trial.families]
    path = _known_alone((*known[:-1], beside), catalogue, told)
    last = _with_unknown(path[-1], catalogue)
    other = _known_alone((*path[:-1], _relinearised(path[-1], catalogue, ended=True)), catalogue, told)
    if other[-1].value > last.value + last.odds_of_unknown:
        path, last = other, _with_unknown(other[-1], catalogue)
    return (*path[:-1], *_climbed(last, catalogue, told, unknown=True))


def _known_alone(path: tuple[At, ...], catalogue: Catalogue, told: Told) -> tuple[At, ...]:
    """The path on to where no effect of the catalogue makes a set more probable."""
    path, followed = (*path[:-1], *_climbed(path[-1], catalogue, told, unknown=False)), [path[-1].keys]
    while path[-1].keys not in followed:
        followed.append(path[-1].keys)
        path = (*path[:-1], *_climbed(_relinearised(path[-1], catalogue), catalogue, told, unknown=False))
    return path if path[-1].keys == followed[-1] else (*path[:-1], _relinearised(path[-1], catalogue))  # it went back


def _with_unknown(at: At, catalogue: Catalogue) -> At:
    """Where a search stands, the empirical families on trial, too."""
    return looked_at(at.campaign, at.fit, catalogue, unknown=True)


def _beside_own_errors(at: At, catalogue: Catalogue) -> At | None:
    """The end of a search beside sequences' own errors, without an unknown that has values of every sequence; ``None``: no such errors."""
    families = {at.trial.evidence.of.keys[e] for e in at.trial.families}
    try:
        campaign, fit = relinearised(at.campaign, at.fit, ended=True)
        if fit is at.fit:
            return None
        evidence = evidence_about(campaign, fit, {})
        kept = tuple(e for e, key in enumerate(evidence.of.keys) if key not in families or not evidence.of.effects[e].entry.scope.own)
        alike = any(evidence.of.keys[e] in families for e in kept)
        return looked_at(*held_anew(*refitted(campaign, fit, evidence, kept)), catalogue, unknown=alike)
    except UNFLYABLE:
        return None


def _relinearised(at: At, catalogue: Catalogue, *, ended: bool = False) -> At:
    """Where a search stands, about priors, surfaces and noise that follow its model; as it is where those do not, or flights run away.

    Where it has ``ended`` there: about errors that sequences have of their own.
    """
    try:
        campaign, fit = held_anew(*relinearised(*held_anew(at.campaign, at.fit), ended=ended))
        return at if fit is at.fit else looked_at(campaign, fit, catalogue)
    except UNFLYABLE:
        return at


def _climbed(at: At, catalogue: Catalogue, told: Told, *, unknown: bool, names: bool = True) -> tuple[At, ...]:
    """The path as far as it goes, with the probabilities at its end that refits confirm; other ``names`` of effects last."""
    path, tried, astray = [at], {frozenset(at.named(at.members))}, 0
    while len(path) <= MOST_STEPS and len(tried) <= MOST_STEPS * ASTRAY:
        wanted = _wanted(path, tried) if astray < ASTRAY else None
        is_name = wanted is None and unknown and names
        wanted = _next_name(path[-1], tried) if is_name else wanted
        if wanted is None:
            break
        now = path[-1]
        tried.add(frozenset(now.named(wanted)))
        new = moved(now, wanted, catalogue, unknown=unknown)
        gained = -np.inf if new is None else min(new.value - new.value_of(now.keys), new.value - now.value)
        if new is None or gained <= (GAIN if is_name else 0.0):
            astray += not is_name
            path[-1] = judged_by(now, replace(now.trial, overrated=(*now.trial.overrated, overrated(now, wanted, gained))))
            continue
        told(f"{', '.join(new.keys) or 'nothing'}: log evidence {gained:+.1f}")
        path.append(new)
        astray = 0
    last = path[-1]
    searched(last.trial, last.members)
    try_pairs(last.trial, last.members)
    return (*path[:-1], judged_by(last, replace(last.trial, fitted=last.members)))


def judged_by(at: At, trial: Trial) -> At:
    """Where a search stands, with the probabilities of all sets that a ``trial`` has by now.

    A linearisation can overrate a set. One that was refitted and refused counts as that fit has it, and so does the step to it in other
    sets. A set that was never refitted counts at most as much as the fitted one once the search has ended.
    """
    return replace(at, trial=trial, judged=posterior_of(trial))


def overrated(now: At, wanted: Set, gained: float) -> Overrated:
    """The step to a set that was refitted and ``gained`` (nats) less than nothing."""
    promised = now.trial.linear(wanted) - now.value
    new, old = frozenset(wanted), frozenset(now.members)
    return Overrated(new - old, old - new, old & new, float(np.clip(promised - min(gained, 0.0), 0.0, IMPOSSIBLE)))


def moved(now: At, members: Set, catalogue: Catalogue, *, unknown: bool | Collection[str]) -> At | None:
    """The campaign refitted with another set, and looked at there; ``None`` where flights run away."""
    try:
        return looked_at(*refitted(now.campaign, now.fit, now.trial.evidence, members), catalogue, unknown=unknown)
    except UNFLYABLE:
        return None


def _wanted(path: list[At], tried: set[frozenset[str]]) -> Set | None:
    """The next set to be refitted where a path ends; pairs are looked at only where nothing else is more probable."""
    if (wanted := _next(path[-1], tried)) is None:
        try_pairs(path[-1].trial, path[-1].members)
        path[-1] = judged_by(path[-1], path[-1].trial)
    return wanted or _next(path[-1], tried)


def _next_name(now: At, tried: set[frozenset[str]]) -> Set | None:
    """The first set, not refitted yet, that exchanges a found effect for another of its names: its linearised evidence may be too high."""
    found, families = (e for e in now.members if e not in now.trial.noise), now.trial.families
    names = (name for e in found for name in group_of(now.trial, now.members, e)[1:] if name.log_odds >= -np.log(FACTOR))
    known = (name.members for name in names if not families & set(name.effects))
    return next((members for members in known if frozenset(now.named(members)) not in tried), None)


def _next(now: At, tried: set[frozenset[str]]) -> Set | None:
    """The most probable set with at most one effect that the fitted one lacks; any, where there is none.

    Effects that are drawn anew in every frame are tried last: any missing effect raises the residuals from frame to frame, as they do.
    """
    least = now.value + GAIN
    better = [s for s in now.posterior.sets if now.trial.log_posterior(s) > least and frozenset(now.named(s)) not in tried]
    better.sort(key=lambda s: any(now.trial.evidence.of.effects[e].random for e in set(s) - set(now.members)))  # stable
    near = [s for s in better if len(set(s) - set(now.members)) <= 1]
    return next(iter(near or better), None)
