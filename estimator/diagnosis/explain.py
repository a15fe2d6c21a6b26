"""The whole loop: test every effect, add the one that explains most, refit, drop what became superfluous, stop at the noise floor.

A step is accepted only if the error of held-out frames of held-out sequences falls (where an effect is drawn anew in every frame, only if
those frames become likelier); two effects that explain only together are judged together. Which effect a step adds is decided by refits
(:mod:`estimator.diagnosis.refitting`). In the end, and after two steps where much is still missing, what was found competes with one
unknown in its place (:mod:`estimator.diagnosis.contest`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.contest import Simpler, better_unknown, criterion_of
from estimator.diagnosis.extending import fit_extended
from estimator.diagnosis.looks import Looks
from estimator.diagnosis.pruning import pruned, tests_at, without_effect
from estimator.diagnosis.ranking import Ranking, rank
from estimator.diagnosis.refits import Refitted, Rules, key_of, named, penalty_of
from estimator.diagnosis.refitting import contenders, in_place, random_contender
from estimator.diagnosis.score_tests import EfficientScores, ScoreTest
from estimator.diagnosis.tested_values import p_words
from estimator.diagnosis.unknown import Unknown, outstanding
from estimator.effects.curvature_bias import CurvatureBias
from estimator.effects.link import EffectModel
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.following import following
from estimator.fitting.held_out import HeldOut, held_out
from estimator.fitting.time_shifts import held_out_gain

MOST_EXCHANGED = 3
"""Effects beside one another, up to which each is looked at again beside the others: more than these imitate something else."""
EXCHANGES = 2
FEW, MUCH_LEFT = 2, 1e-30
"""Steps after which an unknown is looked for at once where p says that much is still missing: many effects imitate it at last, and
none of them is there."""
STILL_AS_GOOD = 1.01
"""Held-out errors over those before, within which a simpler effect takes the place of one that contains it."""


@dataclass(frozen=True)
class Step:
    """One step: the effect added, the group it cannot be told from, tests and ranking before it, held-out errors before and after.

    ``judged_at``: the fit without the effect and the tests there that the group is from, where these are not those before the step.
    """

    added: str
    group: tuple[str, ...]
    p: float
    tests: tuple[ScoreTest, ...]
    ranking: Ranking
    before: HeldOut
    after: HeldOut
    accepted: bool
    fit: CampaignFit
    judged_at: tuple[CampaignFit, tuple[ScoreTest, ...]] | None = None


@dataclass(frozen=True)
class Explanation:
    """What was found: the steps, the last fit and its covariance, the tests that found nothing more, and what is left unknown.

    ``campaign`` is as it is where the flights were last followed (:mod:`estimator.fitting.following`), ``begun`` as it is at the fit of the
    ``base`` model. ``held_out``: errors of the last fit, which may lack what a step added and another made superfluous.
    """

    begun: Campaign
    campaign: Campaign
    steps: tuple[Step, ...]
    base: CampaignFit
    fit: CampaignFit
    covariance: CampaignCovariance
    tests: tuple[ScoreTest, ...]
    ranking: Ranking
    dropped: tuple[str, ...]
    left: Unknown
    held_out: HeldOut

    @property
    def found(self) -> tuple[str, ...]:
        """Keys of the effects in the last model."""
        return _keys(self.fit)


@dataclass(frozen=True)
class Reached:
    """Where the loop is: the last fit and its campaign, the steps that led there, what was dropped on the way, and its held-out errors."""

    campaign: Campaign
    fit: CampaignFit
    steps: tuple[Step, ...]
    dropped: tuple[str, ...]
    error: HeldOut


Told = Callable[[str], None]
Tested = tuple[list[ScoreTest], Ranking]


def _keys(fit: CampaignFit) -> tuple[str, ...]:
    """Effects of a model beside the instrument's own discrepancy."""
    return tuple(k for k in fit.model.keys if k != CurvatureBias.entry.key)


def start_with(state: CampaignState, size: int) -> CampaignState:
    """Flights with ``size`` effect parameters at zero."""
    return CampaignState(state.flights, tuple(np.zeros(size) for _ in state.flights))


def explain(
    campaign: Campaign,
    start: CampaignState,
    catalogue: Mapping[str, EffectModel],
    rules: Rules,
    *,
    told: Told = lambda _sentence: None,
) -> Explanation:
    """Add effects of ``catalogue`` to the base model until nothing more is found."""
    model = campaign.kind.base
    begun, base = following(campaign, fit_campaign(campaign, start_with(start, model.size), model))
    at = Reached(begun, base, (), (), held_out(begun, base.state, base.model))
    few = replace(rules, most_effects=min(FEW, rules.most_effects))
    looks = Looks(catalogue)
    found, last = _climbed(at, looks, few, told)
    simpler = None
    if len(found.steps) >= FEW and found.steps[-1].accepted and _missing(last[0]) <= rules.alpha:
        simpler = _unknown_instead(begun, base, found, looks) if _missing(last[0]) < MUCH_LEFT else None
        if simpler is None:
            found, last = _climbed(found, looks, rules, told)
    if simpler is None:
        found, last = _settled(found, last, looks, rules, told)
        simpler = _unknown_instead(begun, base, found, looks)
    if simpler is not None:
        told(f"something unknown ({simpler.unknown.stage}) explains it in fewer words than {', '.join(_keys(found.fit))}")
        found, last = _replaced(found, simpler, looks)
    campaign, fit, (tests, ranking) = found.campaign, found.fit, last
    left = simpler.unknown if simpler is not None else outstanding(looks.at(campaign, fit).families)
    dropped = tuple(key for key in dict.fromkeys(found.dropped) if key not in fit.model.keys)
    covariance = campaign_covariance(campaign, fit)
    return Explanation(begun, campaign, found.steps, base, fit, covariance, tuple(tests), ranking, dropped, left, found.error)


def _replaced(at: Reached, simpler: Simpler, looks: Looks) -> tuple[Reached, Tested]:
    """Without the effects in whose place something unknown stands, in the campaign in which that was judged, and the tests there."""
    campaign, fit = simpler.campaign, simpler.fit
    dropped = (*at.dropped, *(key for key in _keys(at.fit) if key not in fit.model.keys))
    tests, scores = looks.at(campaign, fit).catalogue
    ranking = rank(scores, tests, penalty=penalty_of(campaign))
    return Reached(campaign, fit, at.steps, dropped, held_out(campaign, fit.state, fit.model)), (tests, ranking)


def _missing(tests: Sequence[ScoreTest]) -> float:
    """p-value that nothing is missing, corrected for the number of candidates."""
    return min((t.p for t in tests), default=1.0) * len(tests)


def _unknown_instead(begun: Campaign, base: CampaignFit, at: Reached, looks: Looks) -> Simpler | None:
    """Something unknown that explains the campaign in fewer words than the effects that were added."""
    fits = (base, *(step.fit for step in at.steps if step.accepted))[:-1]  # none where nothing was added
    return better_unknown(at.campaign, fits, at.fit, looks, again=at.campaign is not begun)


def _settled(at: Reached, last: Tested, looks: Looks, rules: Rules, told: Told) -> tuple[Reached, Tested]:
    """With effects exchanged for what explains more beside the others, and one that contains what is there by that; the last tests."""
    for _ in range(EXCHANGES):
        before, at = at.fit, _exchanged(at, looks.catalogue, rules, told)
        if at.fit is before:
            break
        at, last = _climbed(at, looks, rules, told)
    step = _simplified(at.campaign, at.fit, looks, at.error)
    if step is None:
        return at, last
    told(f"{step.added} explains as much as {step.group[1]}")
    return replace(at, steps=(*at.steps, step), fit=step.fit, dropped=(*at.dropped, step.group[1]), error=step.after), last


def _climbed(at: Reached, looks: Looks, rules: Rules, told: Told) -> tuple[Reached, Tested]:
    """With effects added until nothing more is found and what became superfluous dropped; the tests that found nothing more."""
    while True:
        tests, scores = looks.at(at.campaign, at.fit).catalogue
        ranking = rank(scores, tests, penalty=penalty_of(at.campaign))
        p = _missing(tests)
        if p > rules.alpha or len(at.steps) >= rules.most_effects:
            break
        told(f"the fit misses something ({p_words(p)}); refitting the likeliest effects")
        new = _steps(at.campaign, at.fit, (tests, scores, ranking), rules, at.error)
        if not new:
            break
        after, superfluous = pruned(at.campaign, new[-1].fit, rules) if at.steps and new[-1].accepted else (new[-1].fit, ())
        if {step.added for step in new} & set(superfluous):  # compatible with zero: nothing would be gained
            new = tuple(replace(step, accepted=False) for step in new)
        new = (replace(new[0], p=p), *new[1:])
        for step in new:
            refused = "" if step.accepted else ": refused"
            told(f"{step.added}: held-out RMS {step.before.rms_px:.4f} -> {step.after.rms_px:.4f} {at.campaign.kind.unit}{refused}")
        if not new[-1].accepted:
            at = replace(at, steps=(*at.steps, *new))
            break
        at = _followed(at, new, after, superfluous)
    fit, superfluous = pruned(at.campaign, at.fit, rules)
    if superfluous:
        at = replace(at, fit=fit, dropped=(*at.dropped, *superfluous), error=held_out(at.campaign, fit.state, fit.model))
    return at, (tests, ranking)


def _followed(at: Reached, new: tuple[Step, ...], fit: CampaignFit, superfluous: tuple[str, ...]) -> Reached:
    """Where the steps ``new`` lead, to ``fit``: without what became superfluous, and with tables followed."""
    campaign, fit = following(at.campaign, fit)
    error = new[-1].after
    if campaign is not at.campaign or superfluous:
        error = held_out(campaign, fit.state, fit.model)
        new = (*new[:-1], replace(new[-1], after=error))
    return Reached(campaign, fit, (*at.steps, *new), (*at.dropped, *superfluous), error)


def _exchanged(at: Reached, catalogue: Mapping[str, EffectModel], rules: Rules, told: Told) -> Reached:
    """With one effect in another's place, where that explains more beside the others and held-out errors fall.

    The first effect of several is chosen while the others are missing, and may be one that imitates a part of them. Where none is
    exchanged, each has the group that it cannot be told from beside the others; what explains more there but makes held-out errors no
    smaller belongs to it, and so does what contains it and said more when it was added: others may imitate that since.
    """
    own = [key for key in _keys(at.fit) if key in {step.added for step in at.steps}]
    if not 1 < len(own) <= MOST_EXCHANGED:
        return at
    steps = list(at.steps)
    for key in own:
        number = at.fit.model.keys.index(key)
        if at.fit.model.effects[number].random:
            continue
        without = without_effect(at.campaign, at.fit, number)
        tests, scores = tests_at(at.campaign, without, catalogue)
        ranking = rank(scores, tests, penalty=penalty_of(at.campaign))
        leader = in_place(at.campaign, without, at.fit, (tests, scores, ranking), rules, key)
        if leader is None:
            continue
        as_it_is = next((each for each in (leader, *leader.rivals) if key_of(each) == key), None)
        if as_it_is is None or as_it_is.evidence > leader.evidence + rules.margin:
            after = held_out(at.campaign, leader.fit.state, leader.fit.model)
            if after.rms_px < at.error.rms_px:
                told(f"{key_of(leader)} explains more than {key} beside the others")
                judged = (without, tuple(tests))
                step = Step(key_of(leader), leader.group, leader.test.p, judged[1], ranking, at.error, after, True, leader.fit, judged)
                return _followed(at, (step,), leader.fit, (key,))
        last = max(i for i, step in enumerate(steps) if step.added == key)
        containing = (t.effect.entry.key for t in tests if key in t.effect.contains and t.effect.entry.key in steps[last].group)
        group = named((key, *containing, *leader.group))
        steps[last] = replace(steps[last], group=group, judged_at=(without, tuple(tests)))
    return replace(at, steps=tuple(steps))


def _steps(
    campaign: Campaign, fit: CampaignFit, found: tuple[list[ScoreTest], EfficientScores, Ranking], rules: Rules, error: HeldOut
) -> tuple[Step, ...]:
    """The step to one effect more, or the two to a pair, which is accepted as a whole or with its larger member alone.

    Where held-out frames refuse an effect, those that cannot be told from it get their chance.

    An effect drawn anew in every frame comes first where it explains most, but imitates what moves frames apart: where held-out frames
    refuse it, the others get their chance. It lowers no error, since nobody can predict it; it has to make the held-out errors likelier.
    """
    tests, _, ranking = found
    steps: tuple[Step, ...] = ()
    for find in (random_contender, contenders):
        chosen = find(campaign, fit, found, rules)
        if not chosen:
            continue
        errors = [error, *(held_out(campaign, each.fit.state, each.fit.model) for each in chosen)]
        if chosen[0].test.random:
            last = int(held_out_gain([campaign.kind.time_shifts(campaign, i, each) for i, each in enumerate(fit.equations)]) > 0.0)
        else:
            last = min(range(len(errors)), key=lambda i: errors[i].rms_px)
            if last == 0:
                chosen, errors, last = _rival(campaign, chosen, errors)
        steps = tuple(
            Step(each.test.effect.entry.key, each.group, each.test.p, tuple(tests), ranking, before, after, last > 0, each.fit)
            for each, before, after in zip(chosen[: last or None], errors[:-1], errors[1:], strict=False)
        )
        if last > 0:
            break
    return steps


def _rival(campaign: Campaign, chosen: tuple[Refitted, ...], errors: list[HeldOut]) -> tuple[tuple[Refitted, ...], list[HeldOut], int]:
    """Of what cannot be told from the chosen effect, which held-out errors refuse, what they like best; nothing is accepted without."""
    group = chosen[0].group
    found = [(held_out(campaign, rival.fit.state, rival.fit.model), rival) for rival in chosen[0].rivals]
    after, rival = min(found, key=lambda each: each[0].rms_px, default=(errors[0], chosen[0]))
    if after.rms_px >= errors[0].rms_px:
        return chosen, errors, 0
    own = key_of(rival)
    return (replace(rival, group=named((own, *group))),), [errors[0], after], 1


def _simplified(campaign: Campaign, fit: CampaignFit, looks: Looks, error: HeldOut) -> Step | None:
    """A step that puts what an effect contains in its place, where the criterion falls and held-out errors stay."""
    for number, effect in enumerate(fit.model.effects):
        for key in effect.contains:
            if key not in looks.catalogue or key in fit.model.keys:
                continue
            without = without_effect(campaign, fit, number)
            tests, scores = tests_at(campaign, without, {key: looks.catalogue[key]})
            new = fit_extended(campaign, without, tests[0])
            if criterion_of(campaign, new, looks) >= criterion_of(campaign, fit, looks):
                continue
            after = held_out(campaign, new.state, new.model)
            if after.rms_px <= STILL_AS_GOOD * error.rms_px:
                ranking = rank(scores, tests, penalty=penalty_of(campaign))
                return Step(key, (key, effect.entry.key), tests[0].p, tuple(tests), ranking, error, after, True, new)
    return None
