"""What was found in the catalogue against one unknown in its place.

Effects that are free in every sequence, or several together, can imitate something that the catalogue lacks: a thrust that turns with the
body looks like another draught in every sequence. Empirical families (:mod:`estimator.effects.empirical`) therefore compete with the
last model for what each step of it had still to explain. All are refitted and compared by Schwarz's criterion [1978]: what the scores of
all effects and families say is left, less what chance leaves, plus a penalty per parameter: the logarithm of the measurements that tell
of it, all of them or those of its own sequence [Pauler 1998]. A family has to win by a margin, since it says less than an effect.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.extending import fit_extended
from estimator.diagnosis.ranking import by_remainder
from estimator.diagnosis.score_tests import Candidates, ScoreTest, score_tests
from estimator.diagnosis.unknown import ALPHA, Unknown, families
from estimator.effects.empirical import EMPIRICAL, ForceField
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.effects.plane_field import PlaneField, plane_field_like
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, fit_campaign

MARGIN = 10.0
"""Of the criterion, by which an unknown must be better: very strong evidence [Kass and Raftery 1995]."""
WORTH_A_FIT = 0.5
"""Largest share of the misfit that a family may leave in a linear look and still be refitted: a look at a large effect is a poor one."""
REFITTED = 2


@dataclass(frozen=True)
class Simpler:
    """An unknown that explains a campaign better than the catalogue: the fit it is added to, and the family."""

    fit: CampaignFit
    unknown: Unknown


def better_unknown(
    campaign: Campaign, before: Sequence[CampaignFit], last: CampaignFit, catalogue: Mapping[str, EffectModel]
) -> Simpler | None:
    """The best family in place of what was added after one of the fits ``before``, or ``None`` where the ``last`` fit is better."""
    criterion = _criterion(campaign, last, catalogue)
    found, beaten = None, criterion - MARGIN
    # what a model that is right may leave, less its degrees of freedom: noise is counted with caution
    chance = min(criterion - penalty_of(campaign, last.model.effects), 0.0)
    for fit in before:
        own = penalty_of(campaign, fit.model.effects)
        if own + min(_least_penalty(campaign, family) for family in EMPIRICAL.values()) + chance >= beaten:
            continue  # the least of them would not win if it left no more than chance does
        for test, tests, p in _likely(campaign, fit, catalogue):
            if p > ALPHA or own + _least_penalty(campaign, test.effect) + chance >= beaten:
                continue
            criterion = min(_criteria(campaign, fit, test, catalogue), default=np.inf)
            if criterion < beaten:
                found, beaten = Simpler(fit, Unknown(test, p, tests)), criterion
    return found


def penalty_of(campaign: Campaign, effects: Iterable[EffectModel | type[EffectModel]]) -> float:
    """Schwarz's penalty of the free parameters of ``effects``."""
    sequences = len(campaign.sequences)
    n = campaign.kind.independent(campaign)
    free = [e for e in effects if e.held is None]
    of_all = sum(len(e.entry.parameters) for e in free if e.entry.scope is not Scope.SEQUENCE)
    of_one = sum(len(e.entry.parameters) for e in free if e.entry.scope is Scope.SEQUENCE)
    return float(of_all * np.log(n) + sequences * of_one * np.log(n / sequences))


def _least_penalty(campaign: Campaign, family: EffectModel) -> float:
    """Penalty of a family, or of the narrower one that may stand for it."""
    return penalty_of(campaign, (PlaneField if isinstance(family, ForceField) else family,))


def _criteria(campaign: Campaign, fit: CampaignFit, test: ScoreTest, catalogue: Mapping[str, EffectModel]) -> Iterator[float]:
    """The criteria of refits with a family: a field of force also as one that points one way; none of what cannot be flown."""
    try:
        refitted = fit_extended(campaign, fit, test)
        yield _criterion(campaign, refitted, catalogue)
        if isinstance(test.effect, ForceField):
            yield _criterion(campaign, _one_way(campaign, fit, refitted, test.effect), catalogue)
    except (ValueError, np.linalg.LinAlgError):
        return


def _one_way(campaign: Campaign, fit: CampaignFit, refitted: CampaignFit, field: ForceField) -> CampaignFit:
    """The refit with a plane field in place of a field that is linear in the place."""
    place = np.concatenate([each.errors.prediction.poses.centre[:, 0] for each in refitted.equations])
    theta = refitted.state.theta[0][refitted.model.slices[-1]]
    plane, values = plane_field_like(field.force(np.tile(theta, (len(place), 1)), place), place)
    own = refitted.model.slices[-1].start
    state = CampaignState(refitted.state.flights, tuple(np.concatenate([t[:own], values]) for t in refitted.state.theta))
    return fit_campaign(campaign, state, Model((*fit.model.effects, plane)))


def _others(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel]) -> tuple[Candidates, int]:
    """Everything that is not in a model, the catalogue's first, and how many of those there are."""
    known = Candidates.of(campaign, (e for key, e in catalogue.items() if key not in fit.model.keys and not e.random))
    wide = Candidates.of(campaign, (e for e in families(campaign, fit) if e.entry.key not in fit.model.keys))
    return Candidates(known.effects + wide.effects, known.starts + wide.starts), len(known.effects)


def _criterion(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel]) -> float:
    """What is left at a fit, less its degrees of freedom, plus the penalty of the model's parameters."""
    others, _ = _others(campaign, fit, catalogue)
    _, scores = score_tests(campaign, fit, others)
    left = by_remainder(scores, penalty=0.0)
    return left.nothing - left.columns + penalty_of(campaign, fit.model.effects)


def _likely(
    campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel]
) -> list[tuple[ScoreTest, tuple[ScoreTest, ...], float]]:
    """The families that explain most of a misfit in a linear look, all families' tests, and the corrected p-value."""
    others, known = _others(campaign, fit, catalogue)
    tests, scores = score_tests(campaign, fit, others)
    ranking, wide = by_remainder(scores, penalty=0.0), tuple(tests[known:])
    worth = [h for h in ranking.hypotheses if h.effect >= known and h.remainder < WORTH_A_FIT * ranking.nothing + ranking.columns]
    worth.sort(key=lambda h: h.criterion + penalty_of(campaign, (tests[h.effect].effect,)))
    return [(tests[h.effect], wide, min(1.0, tests[h.effect].p * len(wide))) for h in worth[:REFITTED]]
