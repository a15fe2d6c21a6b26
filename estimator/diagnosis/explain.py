"""The whole loop: test every effect, add the one that explains most, refit, drop what became superfluous, stop at the noise floor.

A step is accepted only if the error of held-out frames of held-out sequences falls. Candidates that a linear look ranks close together are
refitted one by one; those that leave the same remainder are one alias group. In the end what was found competes with one unknown in its
place (:mod:`estimator.diagnosis.contest`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.contest import better_unknown
from estimator.diagnosis.extending import extended
from estimator.diagnosis.ranking import IMPLAUSIBLE, Hypothesis, Ranking, by_remainder, plausible, rank
from estimator.diagnosis.score_tests import Candidates, EfficientScores, ScoreTest, score_tests
from estimator.diagnosis.unknown import Unknown, unknown
from estimator.effects.curvature_bias import CurvatureBias
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.held_out import HeldOut, held_out
from estimator.motion.flight import N_PARAMETERS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rules:
    """When to believe.

    ``alpha``: p-value, corrected for the number of candidates, below which an effect is taken for missing. ``margin``: difference of the
    criterion within which effects cannot be told apart. ``shortlist``: effects refitted per step; ``window``: criterion above the
    best within which they are. ``most_effects`` a model may gain. ``superfluous``: p-value above which an effect is dropped again.
    """

    alpha: float = 0.01
    margin: float = 6.0
    shortlist: int = 4
    window: float = 40.0
    most_effects: int = 4
    superfluous: float = 0.05


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
    """What was found: the steps, the last fit and its covariance, the tests that found nothing more, and what is left unknown."""

    steps: tuple[Step, ...]
    base: CampaignFit
    fit: CampaignFit
    covariance: CampaignCovariance
    tests: tuple[ScoreTest, ...]
    ranking: Ranking
    dropped: tuple[str, ...]
    left: Unknown

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


def penalty_of(campaign: Campaign) -> float:
    """Penalty per parameter: the logarithm of the number of independent measurements [Schwarz 1978]."""
    return float(np.log(campaign.kind.independent(campaign)))


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
    base = fit = fit_campaign(campaign, start_with(start, model.size), model)
    steps: list[Step] = []
    error = held_out(campaign, fit.state, fit.model)
    while True:
        tests, scores = _tests(campaign, fit, catalogue)
        ranking = rank(scores, tests, penalty=penalty_of(campaign))
        p = min((t.p for t in tests), default=1.0) * len(tests)
        if p > rules.alpha or len(steps) >= rules.most_effects:
            break
        told(f"the fit misses something (p = {p:.1e}); refitting the likeliest effects")
        step = _step(campaign, fit, (tests, scores, ranking), rules, error)
        step = replace(step, p=p)
        steps.append(step)
        told(f"{step.added}: held-out RMS {step.before.rms_px:.4f} -> {step.after.rms_px:.4f} {campaign.kind.unit}")
        if not step.accepted:
            break
        fit, error = step.fit, step.after
    fit, dropped = _pruned(campaign, fit, rules)
    before = (base, *(step.fit for step in steps if step.accepted))[:-1]
    simpler = better_unknown(campaign, before, fit, catalogue, penalty=penalty_of(campaign)) if steps and steps[0].accepted else None
    if simpler is not None:
        told(f"something unknown ({simpler.unknown.stage}) explains it in fewer words than {', '.join(_keys(fit))}")
        dropped += tuple(key for key in _keys(fit) if key not in simpler.fit.model.keys)
        fit = simpler.fit
    left = simpler.unknown if simpler is not None else unknown(campaign, fit)
    return Explanation(tuple(steps), base, fit, campaign_covariance(campaign, fit), tuple(tests), ranking, dropped, left)


def _tests(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel]) -> tuple[list[ScoreTest], EfficientScores]:
    return score_tests(campaign, fit, Candidates.of(campaign, (e for key, e in catalogue.items() if key not in fit.model.keys)))


@dataclass(frozen=True)
class _Refitted:
    """A refit: what the data say for it (``evidence``) and, with that its value may be one that nature does not produce, ``criterion``."""

    test: ScoreTest
    fit: CampaignFit
    evidence: float
    criterion: float


def _step(
    campaign: Campaign, fit: CampaignFit, found: tuple[list[ScoreTest], EfficientScores, Ranking], rules: Rules, error: HeldOut
) -> Step:
    tests, _, ranking = found
    first = ranking.hypotheses[0]
    close = [first] if tests[first.effect].random else [h for h in ranking.hypotheses if not tests[h.effect].random]
    close = [h for h in close if h.criterion <= first.criterion + rules.window][: rules.shortlist]
    refitted = sorted((_refit(campaign, fit, tests, h) for h in close), key=lambda r: r.criterion)
    chosen = refitted[0]
    group = tuple(r.test.effect.entry.key for r in refitted if r.evidence <= chosen.evidence + rules.margin)
    after = held_out(campaign, chosen.fit.state, chosen.fit.model)
    return Step(
        added=chosen.test.effect.entry.key,
        group=group,
        p=chosen.test.p,
        tests=tuple(tests),
        ranking=ranking,
        before=error,
        after=after,
        accepted=after.rms_px < error.rms_px,
        fit=chosen.fit,
    )


def _refit(campaign: Campaign, fit: CampaignFit, tests: list[ScoreTest], hypothesis: Hypothesis) -> _Refitted:
    """Refit with one effect more; the criterion is what the scores of all the others say is left, plus the penalty."""
    test = tests[hypothesis.effect]
    model, start = extended(fit, test)
    new = fit_campaign(campaign, start, model)
    others = [t for i, t in enumerate(tests) if i != hypothesis.effect and not t.random]
    candidates = Candidates(tuple(t.effect for t in others), tuple(np.unique(np.stack(list(t.starts.values())), axis=0) for t in others))
    _, scores = score_tests(campaign, new, candidates)
    left = by_remainder(scores, penalty=0.0).nothing
    odd = 0.0 if plausible(test, _values(new, test)) else IMPLAUSIBLE
    evidence = left + penalty_of(campaign) * hypothesis.parameters
    return _Refitted(test, new, evidence, evidence + odd)


def _values(fit: CampaignFit, test: ScoreTest) -> Array:
    """Fitted values (c,) of a test's columns; the tested effect is the last of the model."""
    part = fit.model.slices[-1]
    return np.array([fit.state.theta[column.sequence or 0][part][column.parameter] for column in test.columns])


def _pruned(campaign: Campaign, fit: CampaignFit, rules: Rules) -> tuple[CampaignFit, tuple[str, ...]]:
    """The fit without effects whose parameters are compatible with zero once all are there."""
    dropped: list[str] = []
    while True:
        covariance = campaign_covariance(campaign, fit)
        weakest = max(
            ((wald_p(fit, covariance, e), e) for e, effect in enumerate(fit.model.effects) if effect.held is None and not effect.random),
            default=(0.0, -1),
        )
        if weakest[0] <= rules.superfluous:
            return fit, tuple(dropped)
        part = fit.model.slices[weakest[1]]
        dropped.append(fit.model.effects[weakest[1]].entry.key)
        model = Model(tuple(e for i, e in enumerate(fit.model.effects) if i != weakest[1]))
        state = CampaignState(fit.state.flights, tuple(np.delete(t, np.r_[part]) for t in fit.state.theta))
        fit = fit_campaign(campaign, state, model)


def wald_p(fit: CampaignFit, covariance: CampaignCovariance, number: int) -> float:
    """p-value of effect ``number`` being zero; parameters that are searched for do not count."""
    effect, part = fit.model.effects[number], fit.model.slices[number]
    parameters = effect.entry.parameters
    counted = [i for i, p in enumerate(parameters) if p.name not in effect.entry.searched or len(parameters) == 1]
    columns = part.start + np.array(counted)
    sequences = range(len(fit.state.theta)) if effect.entry.scope is Scope.SEQUENCE else range(1)
    rows = np.concatenate([covariance.place[s][N_PARAMETERS + columns] for s in sequences])
    theta = np.concatenate([fit.state.theta[s][columns] for s in sequences])
    C = covariance.covariance[np.ix_(rows, rows)]
    statistic = float(theta @ np.linalg.pinv(C, rcond=1e-12, hermitian=True) @ theta)
    return float(chi2.sf(statistic, len(rows)))
