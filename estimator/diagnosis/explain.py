"""The whole loop: the most probable set of effects, what each of them is worth, what cannot be told from it, and what is left unknown.

Which effects belong into the model is decided by their evidence alone (:mod:`estimator.diagnosis.selection`). The error of held-out frames
of held-out sequences is told beside it, effect by effect, as a check that a person understands; it decides nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from estimator.diagnosis.adding import fit_with
from estimator.diagnosis.diagnose import Diagnosis, Unknown, diagnosis_at
from estimator.diagnosis.selection.groups import FACTOR, group_of, sureness
from estimator.diagnosis.selection.names import UnderName, under_names
from estimator.diagnosis.selection.path import At, Told, looked_at, moved, path_from
from estimator.diagnosis.selection.refitting import refitted
from estimator.diagnosis.selection.search import Set
from estimator.diagnosis.selection.testing import tests_beside
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.campaigns.held_out import HeldOut, held_out
from estimator.fitting.campaigns.weighing_again import UNFLYABLE

ESTABLISHED = FACTOR / (1.0 + FACTOR)
"""Probability from which on an effect, or something in its place, is established; below, it is suspected."""


@dataclass(frozen=True)
class Step:
    """One effect of the explanation, ``added`` its key, in the campaign that was ``fit`` with the effects up to it.

    ``names``: it, and what these data cannot tell from it, the most probable first; ``probability`` of the effect to be in the model, and
    how ``sure`` it is that it or something in its place is, 0 to 1; ``worth``: log evidence (nats) that the model loses without it;
    ``p`` of its score test in the base model; ``before``, ``after``: errors of what was not fitted, without it and with it, beside the
    effects that the search found before.
    """

    added: str
    names: tuple[UnderName, ...]
    probability: float
    sure: float
    worth: float
    p: float
    before: HeldOut
    after: HeldOut
    fit: CampaignFit

    @property
    def group(self) -> tuple[str, ...]:
        """Keys of its names; two effects together are one key."""
        return tuple(name.key for name in self.names)

    @property
    def odds(self) -> tuple[float, ...]:
        """Log odds (nats) of the set with each of its names against the set as it is."""
        return tuple(name.log_odds for name in self.names)

    @property
    def established(self) -> bool:
        """Whether all that has neither it nor something in its place is less probable by ``FACTOR``; else it is suspected."""
        return self.sure >= ESTABLISHED


@dataclass(frozen=True)
class Explanation:
    """What was found.

    ``begun``: the base model and all sets' evidence about its fit; ``last``: the most probable set without a family that stands for
    something unknown, and evidence about it; ``path``: the search's way to the most probable set, what is unknown in it: values and
    velocities are those there; ``rungs``: the effects in the order in which the search found them. Of the last fit ``covariance``,
    ``diagnosis``, and errors ``held_out`` on what was not fitted; ``left``: what no effect of the catalogue explains, ``None`` where no
    empirical family applies.
    """

    begun: At
    last: At
    path: tuple[At, ...]
    rungs: tuple[Step, ...]
    covariance: CampaignCovariance
    diagnosis: Diagnosis
    left: Unknown | None
    held_out: HeldOut

    @property
    def campaign(self) -> Campaign:
        """The campaign as it is at the last fit."""
        return self.last.campaign

    @property
    def fit(self) -> CampaignFit:
        """The last fit."""
        return self.last.fit

    @property
    def steps(self) -> tuple[Step, ...]:
        """The effects that were found, those that are worth most first."""
        return tuple(sorted(self.rungs, key=lambda step: -step.worth))

    @property
    def found(self) -> tuple[str, ...]:
        """Keys of the effects in the last model."""
        return tuple(step.added for step in self.steps)

    @property
    def in_place(self) -> tuple[str, ...]:
        """Keys of what was found that the most probable set lacks: something unknown has its place there."""
        return tuple(key for key in self.found if key not in self.path[-1].keys)

    @property
    def noise(self) -> tuple[str, ...]:
        """Keys of the last model's effects that are noise of what was measured."""
        return tuple(effect.entry.key for effect in self.fit.model.effects if effect.noise)

    @property
    def groups(self) -> tuple[tuple[UnderName, ...], ...]:
        """The groups that have several names, each name with its values."""
        return tuple(step.names for step in self.steps if len(step.names) > 1)


def explain(
    campaign: Campaign, start: CampaignState, catalogue: Mapping[str, EffectModel], *, told: Told = lambda _sentence: None
) -> Explanation:
    """Find the most probable set of effects of a ``catalogue``."""
    begun = looked_at(*fit_with(campaign, start, ()), catalogue)
    told("every effect was tested")
    path = path_from(begun, catalogue, told)
    best = path[-1]
    last = _without_families(path, catalogue)
    unknown = [e for e in best.members if e in best.trial.families]
    rungs = _rungs([*path, last], best, told, with_families=not unknown)
    error = rungs[-1].after if rungs else held_out(last.campaign, last.fit.state, last.fit.model)
    diagnosis = _as_probable_as_in(best, diagnosis_at(last, ended=True))
    known = next(at for at in reversed(path) if not set(at.members) & at.trial.families)  # all that the catalogue can do, by its own fit
    beside = [at for at in path if at.campaign.kind.base.keys == known.campaign.kind.base.keys]  # the same noise
    sure = max((sureness(best.trial, best.members, e, most=beside[-1].value - known.value) for e in unknown), default=1.0)
    left = diagnosis.unknown and replace(diagnosis.unknown, present=bool(unknown), sure=sure)
    return Explanation(begun, last, path, rungs, campaign_covariance(last.campaign, last.fit), diagnosis, left, error)


def _as_probable_as_in(best: At, diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis with the probabilities of the most probable set: without the unknown, others stand for a part of it."""
    numbers = {key: e for e, key in enumerate(best.trial.evidence.of.keys)}
    known = [replace(f, probability=best.posterior.probability(numbers[f.key])) if f.key in numbers else f for f in diagnosis.findings]
    return replace(diagnosis, findings=tuple(known))


def _without_families(path: tuple[At, ...], catalogue: Mapping[str, EffectModel]) -> At:
    """The last set without what stands for something unknown; where that cannot be flown, the last one that has none.

    What is not established beside the unknown may be a part of it, and would stand for more of it alone: it goes, too. Where the unknown
    has taken the place of values of every sequence, accelerations of every sequence are there again, if that is more probable: they claim
    no cause either, as a lift would. Where it is of their stage they are not: its curves are fitted in their place, and a law would be
    left with what they do not take.
    """
    best = path[-1]
    if not set(best.members) & best.trial.families:
        return best
    known = [at for at in path if not set(at.members) & at.trial.families]
    kept = [e for e in best.members if e not in best.trial.families and sureness(best.trial, best.members, e) >= ESTABLISHED]
    effects = best.trial.evidence.of.effects
    stages = {effects[e].entry.stage for e in set(best.members) & best.trial.families}
    apart = {e for e, effect in enumerate(effects) if effect.entry.scope.own and effect.entry.stage not in stages}
    replaced = any(effects[e].entry.key in known[-1].keys for e in apart - best.trial.noise)
    own = {e for e in apart if effects[e].constant and replaced}
    wanted = max((tuple(kept), tuple(sorted({*kept, *own}))), key=best.trial.log_posterior)
    return moved(best, wanted, catalogue, unknown=True) or known[-1]


def _rungs(path: Sequence[At], best: At, told: Told, *, with_families: bool) -> tuple[Step, ...]:
    """The effects of the last model on the ``path``, as the search found them, each with held-out errors beside those before it.

    What the most probable set has is judged there; what is told in the unknown's place, in the last model. Something unknown is a name of
    one of them only where it is not told as missing beside them: its place is known then.
    """
    begun, last = path[0], path[-1]
    judged = {key: best if key in best.keys else last for key in last.keys}
    places = {key: (at, at.trial.evidence.of.keys.index(key)) for key, at in judged.items()}
    keys = [key for key, (at, e) in places.items() if e not in at.trial.noise]
    worth = {k: at.value - at.trial.log_posterior(tuple(m for m in at.members if m != e)) for k, (at, e) in places.items() if k in keys}
    first = {key: next(i for i, at in enumerate(path) if key in at.keys) for key in keys}
    tests = {t.effect.entry.key: t for t in tests_beside(begun.trial.evidence.of)}
    before = held_out(last.campaign, begun.fit.state, begun.fit.model) if keys else None
    found: list[Step] = []
    for key in sorted(keys, key=lambda key: (first[key], -worth[key])):
        at, e = places[key]
        fit = _with(last, (*(step.added for step in found), key))
        after = held_out(last.campaign, fit.state, fit.model)
        stated = (at.posterior.probability(e), sureness(at.trial, at.members, e))  # first: names are among the sets that are searched
        group = tuple(n for n in group_of(at.trial, at.members, e) if with_families or not set(n.effects) & at.trial.families)
        p = tests[key].p * len(tests) if key in tests else float("nan")
        assert before is not None
        found.append(Step(key, under_names(at, group), *stated, worth[key], min(p, 1.0), before, after, fit))
        told(f"{key}: held-out RMS {before.rms_px:.4f} -> {after.rms_px:.4f} {last.campaign.kind.unit}")
        before = after
    return tuple(found)


def _with(last: At, keys: tuple[str, ...]) -> CampaignFit:
    """The campaign fitted with some of the last model's effects; the last fit itself with all, and where some alone cannot be flown."""
    members: Set = tuple(e for e in last.members if e in last.trial.noise or last.trial.evidence.of.keys[e] in keys)
    if members == last.members:
        return last.fit
    try:
        return refitted(last.campaign, last.fit, last.trial.evidence, members, follow=False)[1]
    except UNFLYABLE:
        return last.fit
