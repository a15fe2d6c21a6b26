"""What was found in the catalogue against one unknown in its place.

Effects that are free in every sequence, or several together, can imitate something that the catalogue lacks: a thrust that turns with the
body looks like another draught in every sequence. Empirical families (:mod:`estimator.effects.empirical`) therefore compete with the
last model for what each step of it had still to explain. All are refitted and compared by Schwarz's criterion [1978]: what the scores of
all effects and families say is left, less what chance leaves, plus a penalty per parameter. A family has to win by a margin, since it
says less than an effect.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.extending import extended
from estimator.diagnosis.ranking import by_remainder
from estimator.diagnosis.score_tests import Candidates, ScoreTest, score_tests
from estimator.diagnosis.unknown import Unknown, families
from estimator.effects.link import EffectModel
from estimator.fitting.campaign import Campaign, CampaignFit, fit_campaign

MARGIN = 10.0
"""Of the criterion, by which an unknown must be better: very strong evidence [Kass and Raftery 1995]."""
WORTH_A_FIT = 0.25
"""Largest share of the misfit that a family may leave in a linear look and still be refitted."""
REFITTED = 2


@dataclass(frozen=True)
class Simpler:
    """An unknown that explains a campaign better than the catalogue: the fit it is added to, and the family."""

    fit: CampaignFit
    unknown: Unknown


def better_unknown(
    campaign: Campaign, before: Sequence[CampaignFit], last: CampaignFit, catalogue: Mapping[str, EffectModel], *, penalty: float
) -> Simpler | None:
    """The best family in place of what was added after one of the fits ``before``, or ``None`` where the ``last`` fit is better."""
    found, beaten = None, _criterion(campaign, last, catalogue, penalty) - MARGIN
    n = len(campaign.sequences)
    for fit in before:
        if penalty * (parameters_of(fit.model.effects, n) + min(parameters_of((e,), n) for e in families(fit))) >= beaten:
            continue  # the least of them would not win if it left no more than chance does
        for test, tests, p in _likely(campaign, fit, catalogue, penalty):
            if penalty * parameters_of((*fit.model.effects, test.effect), n) >= beaten:
                continue
            try:
                model, start = extended(fit, test)
                criterion = _criterion(campaign, fit_campaign(campaign, start, model), catalogue, penalty)
            except (ValueError, np.linalg.LinAlgError):  # flights under it run away: what cannot be flown explains nothing
                continue
            if criterion < beaten:
                found, beaten = Simpler(fit, Unknown(test, p, tests)), criterion
    return found


def _others(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel]) -> tuple[Candidates, int]:
    """Everything that is not in a model, the catalogue's first, and how many of those there are."""
    known = Candidates.of(campaign, (e for key, e in catalogue.items() if key not in fit.model.keys and not e.random))
    wide = Candidates.of(campaign, (e for e in families(fit) if e.entry.key not in fit.model.keys))
    return Candidates(known.effects + wide.effects, known.starts + wide.starts), len(known.effects)


def _criterion(campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel], penalty: float) -> float:
    """What is left at a fit, less its degrees of freedom, plus the penalty of the model's parameters."""
    others, _ = _others(campaign, fit, catalogue)
    _, scores = score_tests(campaign, fit, others)
    left = by_remainder(scores, penalty=penalty)
    return left.nothing - left.columns + penalty * parameters_of(fit.model.effects, len(campaign.sequences))


def parameters_of(effects: Iterable[EffectModel], sequences: int) -> int:
    """Free parameters of effects in a campaign."""
    free = (e for e in effects if e.held is None)
    return sum(len(e.entry.parameters) * (sequences if e.entry.scope is Scope.SEQUENCE else 1) for e in free)


def _likely(
    campaign: Campaign, fit: CampaignFit, catalogue: Mapping[str, EffectModel], penalty: float
) -> list[tuple[ScoreTest, tuple[ScoreTest, ...], float]]:
    """The families that explain most of a misfit in a linear look, all families' tests, and the corrected p-value."""
    others, known = _others(campaign, fit, catalogue)
    tests, scores = score_tests(campaign, fit, others)
    ranking, wide = by_remainder(scores, penalty=penalty), tuple(tests[known:])
    worth = [h for h in ranking.hypotheses if h.effect >= known and h.remainder < WORTH_A_FIT * ranking.nothing + ranking.columns]
    return [(tests[h.effect], wide, min(1.0, tests[h.effect].p * len(wide))) for h in worth[:REFITTED]]
