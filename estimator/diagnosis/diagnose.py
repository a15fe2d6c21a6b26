"""What a fitted campaign misses: every candidate's test, what it explains, and which cannot be told apart.

The omnibus of :class:`estimator.diagnosis.ranking.Ranking` says whether anything is missing: all candidates' scores together,
``nothing`` against as many degrees of freedom as there are columns. What is above those is the excess; an effect's share of it is how
far the best value of its parameters brings the remainder down, less what chance would. Where noise is smaller than the model of it
(short campaigns), the excess is what the best candidate takes.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.ranking import Ranking, rank
from estimator.diagnosis.refits import named, penalty_of
from estimator.diagnosis.score_tests import Candidates, ScoreTest, score_tests
from estimator.diagnosis.tested_values import tested_values
from estimator.effects.choosing import beside
from estimator.effects.link import EffectModel
from estimator.fitting.campaign import Campaign, CampaignFit

SEEN_IN_95_PERCENT = 3.3
"""A size this many standard deviations large is called in 95% of cases where 1.65 of them are asked for in addition to 1.65."""


MOST_BLIND = 0.5


@dataclass(frozen=True)
class Finding:
    """One candidate: its test, p-value corrected for the number of candidates, and share of the excess that it explains (0 to 1)."""

    test: ScoreTest
    p: float
    share: float
    criterion: float

    @property
    def key(self) -> str:
        """The effect's key."""
        return self.test.effect.entry.key


@dataclass(frozen=True)
class Diagnosis:
    """All candidates by ascending criterion, and the ``p`` of nothing.

    ``group``: the first and the likeliest of those that these data cannot tell from it.
    """

    findings: tuple[Finding, ...]
    ranking: Ranking
    group: tuple[str, ...]
    p: float


def diagnose(campaign: Campaign, fit: CampaignFit, candidates: Mapping[str, EffectModel], *, margin: float) -> Diagnosis:
    """Test every candidate that is not in the model; ``margin``: difference of the criterion within which effects are one group."""
    tests, scores = score_tests(campaign, fit, Candidates.of(campaign, beside(fit.model.keys, candidates)))
    return diagnosis_of(tests, rank(scores, tests, penalty=penalty_of(campaign)), margin=margin)


def diagnosis_of(tests: list[ScoreTest], ranking: Ranking, *, margin: float) -> Diagnosis:
    """The diagnosis of tests that are there already."""
    gained = [ranking.nothing - h.remainder - h.parameters for h in ranking.hypotheses]
    excess = max([ranking.nothing - ranking.columns, *gained, 1e-12])
    findings = []
    for hypothesis, fall in zip(ranking.hypotheses, gained, strict=True):
        test = tests[hypothesis.effect]
        findings.append(Finding(test, min(1.0, test.p * len(tests)), float(np.clip(fall / excess, 0.0, 1.0)), hypothesis.criterion))
    findings.sort(key=lambda finding: not finding.test.counts)  # a gap of no frames explains nothing
    best = findings[0].criterion if findings else 0.0
    group = named(f.key for f in findings if f.criterion <= best + margin)
    p = min((f.p for f in findings), default=1.0)
    return Diagnosis(tuple(findings), ranking, group, p)


def detectable(test: ScoreTest) -> tuple[float, ...]:
    """Size of each of a test's columns that would be seen in 95% of cases, in the parameter's unit."""
    return tuple(SEEN_IN_95_PERCENT * float(np.sqrt(max(square, 0.0))) for square in np.diag(test.covariance))


def blind_to(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Candidates that these data would not show even at the end of their plausible range."""
    return tuple(finding.key for finding in diagnosis.findings if not _visible(finding.test))


def says_nothing(diagnosis: Diagnosis) -> bool:
    """Whether a campaign is too short to say anything: it is blind to most effects."""
    return len(blind_to(diagnosis)) > MOST_BLIND * len(diagnosis.findings)


def _visible(test: ScoreTest) -> bool:
    largest = {p.name: max(abs(p.plausible[0]), abs(p.plausible[1])) for p in test.effect.entry.parameters}
    sizes = zip(tested_values(test), detectable(test), strict=True)
    return any(0.0 < limit < largest[value.parameter.name] for value, limit in sizes)
