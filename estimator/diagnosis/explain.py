"""The whole loop: test every effect, add the one that explains most, refit, drop what became superfluous, stop at the noise floor.

A step is accepted only if the error of held-out frames of held-out sequences falls (where an effect is drawn anew in every frame, only if
those frames become likelier); two effects that explain only together are judged
together. Which effect a step adds is decided by refits (:mod:`estimator.diagnosis.refitting`). In the end what was found competes with one
unknown in its place (:mod:`estimator.diagnosis.contest`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from estimator.diagnosis.contest import better_unknown, criterion_of
from estimator.diagnosis.extending import fit_extended
from estimator.diagnosis.ranking import Ranking, rank
from estimator.diagnosis.refits import Refitted, Rules, key_of, penalty_of
from estimator.diagnosis.refitting import contenders, random_contender
from estimator.diagnosis.score_tests import Candidates, EfficientScores, ScoreTest, score_tests
from estimator.diagnosis.tested_values import p_words
from estimator.diagnosis.unknown import Unknown, unknown
from estimator.effects.choosing import beside
from estimator.effects.curvature_bias import CurvatureBias
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.following import following
from estimator.fitting.held_out import HeldOut, held_out
from estimator.fitting.time_shifts import held_out_gain
from estimator.motion.flight import N_PARAMETERS

STILL_AS_GOOD = 1.01
"""Held-out errors over those before, within which a simpler effect takes the place of one that contains it."""


@dataclass(frozen=True)
class Step:
    """One step: the effect added, the group it cannot be told from, tests and ranking before it, held-out errors before and after."""

    added: str
    group: tuple[str, ...]
    p: float
    tests: tuple[ScoreTest, ...]
    ranking: Ranking
    before: HeldOut
    after: HeldOut
    accepted: bool
    fit: CampaignFit


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
    told: Callable[[str], None] = lambda _sentence: None,
) -> Explanation:
    """Add effects of ``catalogue`` to the base model until nothing more is found."""
    model = campaign.kind.base
    campaign, fit = following(campaign, fit_campaign(campaign, start_with(start, model.size), model))
    begun, base = campaign, fit
    steps: list[Step] = []
    dropped: tuple[str, ...] = ()
    error = held_out(campaign, fit.state, fit.model)
    while True:
        tests, scores = _tests(campaign, fit, catalogue)
        ranking = rank(scores, tests, penalty=penalty_of(campaign))
        p = min((t.p for t in tests), default=1.0) * len(tests)
        if p > rules.alpha or len(steps) >= rules.most_effects:
            break
        told(f"the fit misses something ({p_words(p)}); refitting the likeliest effects")
        new = _steps(campaign, fit, (tests, scores, ranking), rules, error)
        if not new:
            break
        after, superfluous = _pruned(campaign, new[-1].fit, rules) if steps and new[-1].accepted else (new[-1].fit, ())
        if {step.added for step in new} & set(superfluous):  # compatible with zero: nothing would be gained
            new = tuple(replace(step, accepted=False) for step in new)
        steps += [replace(new[0], p=p), *new[1:]]
        for step in new:
            told(f"{step.added}: held-out RMS {step.before.rms_px:.4f} -> {step.after.rms_px:.4f} {campaign.kind.unit}")
        if not new[-1].accepted:
            break
        dropped += superfluous
        before, error = campaign, new[-1].after
        campaign, fit = following(campaign, after)
        if campaign is not before or superfluous:
            error = held_out(campaign, fit.state, fit.model)
            steps[-1] = replace(steps[-1], after=error)
    fit, superfluous = _pruned(campaign, fit, rules)
    dropped += superfluous
    if superfluous:
        error = held_out(campaign, fit.state, fit.model)
    simplified = _simplified(campaign, fit, catalogue, error)
    if simplified is not None:
        told(f"{simplified.added} explains as much as {simplified.group[1]}")
        dropped += (simplified.group[1],)
        steps, fit, error = [*steps, simplified], simplified.fit, simplified.after
    fits = (base, *(step.fit for step in steps if step.accepted))[:-1]  # none where nothing was added
    simpler = better_unknown(campaign, fits, fit, catalogue, again=campaign is not begun)
    if simpler is not None:
        told(f"something unknown ({simpler.unknown.stage}) explains it in fewer words than {', '.join(_keys(fit))}")
        dropped += tuple(key for key in _keys(fit) if key not in simpler.fit.model.keys)
        fit = simpler.fit
        error = held_out(campaign, fit.state, fit.model)
    left = simpler.unknown if simpler is not None else unknown(campaign, fit)
    covariance = campaign_covariance(campaign, fit)
    return Explanation(begun, campaign, tuple(steps), base, fit, covariance, tuple(tests), ranking, dropped, left, error)


def _tests(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel]) -> tuple[list[ScoreTest], EfficientScores]:
    return score_tests(campaign, fit, Candidates.of(campaign, beside(fit.model.keys, catalogue)))


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
    """What cannot be told from the chosen effect, where held-out errors refuse that and not this; else all as it is, nothing accepted."""
    first, group = chosen[0], chosen[0].group
    for rival in first.rivals:
        after = held_out(campaign, rival.fit.state, rival.fit.model)
        if after.rms_px < errors[0].rms_px:
            own = key_of(rival)
            return (replace(rival, group=(own, *(key for key in group if key != own))),), [errors[0], after], 1
    return chosen, errors, 0


def _pruned(campaign: Campaign, fit: CampaignFit, rules: Rules) -> tuple[CampaignFit, tuple[str, ...]]:
    """The fit without effects whose parameters are compatible with zero once all are there."""
    dropped: list[str] = []
    while True:
        covariance = campaign_covariance(campaign, fit)
        free = [e for e, effect in enumerate(fit.model.effects) if effect.held is None and not effect.random]
        weakest = max(
            ((wald_p(campaign, fit, covariance, e), e) for e in free),
            default=(0.0, -1),
        )
        if weakest[0] <= rules.superfluous:
            return fit, tuple(dropped)
        dropped.append(fit.model.effects[weakest[1]].entry.key)
        fit = _without(campaign, fit, weakest[1])


def _without(campaign: Campaign, fit: CampaignFit, number: int) -> CampaignFit:
    """The fit without effect ``number``."""
    model = Model(tuple(e for i, e in enumerate(fit.model.effects) if i != number))
    state = CampaignState(fit.state.flights, tuple(np.delete(t, np.r_[fit.model.slices[number]]) for t in fit.state.theta))
    return fit_campaign(campaign, state, model)


def _simplified(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel], error: HeldOut) -> Step | None:
    """A step that puts what an effect contains in its place, where the criterion falls and held-out errors stay."""
    for number, effect in enumerate(fit.model.effects):
        for key in effect.contains:
            if key not in catalogue or key in fit.model.keys:
                continue
            without = _without(campaign, fit, number)
            tests, scores = _tests(campaign, without, {key: catalogue[key]})
            new = fit_extended(campaign, without, tests[0])
            if criterion_of(campaign, new, catalogue) >= criterion_of(campaign, fit, catalogue):
                continue
            after = held_out(campaign, new.state, new.model)
            if after.rms_px <= STILL_AS_GOOD * error.rms_px:
                ranking = rank(scores, tests, penalty=penalty_of(campaign))
                return Step(key, (key, effect.entry.key), tests[0].p, tuple(tests), ranking, error, after, True, new)
    return None


def wald_p(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance, number: int) -> float:
    """p-value of effect ``number`` being zero; parameters that are searched for do not count, and numbers of nothing are zero."""
    effect, part = fit.model.effects[number], fit.model.slices[number]
    parameters = effect.entry.parameters
    whole = [part.start + i for i, p in enumerate(parameters) if p.name in effect.whole]
    if whole and not any(np.rint(theta[whole]).any() for theta in fit.state.theta):
        return 1.0
    counted = [i for i, p in enumerate(parameters) if p.name in effect.entry.sizes]
    columns = part.start + np.array(counted)
    sequences = sorted(set(campaign.sharing(effect.entry.scope)))
    rows = np.concatenate([covariance.place[s][N_PARAMETERS + columns] for s in sequences])
    theta = np.concatenate([fit.state.theta[s][columns] for s in sequences])
    C = covariance.covariance[np.ix_(rows, rows)]
    statistic = float(theta @ np.linalg.pinv(C, rcond=1e-12, hermitian=True) @ theta)
    return float(chi2.sf(statistic, len(rows)))
