"""Whether something is left that no effect of the catalogue explains, and at which stage it sits.

A fitted model is tested against every empirical family (:mod:`estimator.effects.empirical`). They have many parameters, so each one's
statistic is judged against as many degrees of freedom; among those that stand out, the one that best explains the scores of all of
them names the stage.
"""

from dataclasses import dataclass

import numpy as np

from datasets.vocabulary.effects import Stage
from estimator.diagnosis.ranking import by_remainder
from estimator.diagnosis.score_tests import Candidates, ScoreTest, Tested, score_tests
from estimator.effects.empirical import EMPIRICAL, ForceField, ZoomInTime
from estimator.effects.link import EffectModel
from estimator.fitting.campaign import Campaign, CampaignFit

ALPHA = 1e-3
PENALTY = 2.0
"""Per parameter [Akaike 1974]: families differ in size, and none is a law."""


@dataclass(frozen=True)
class Unknown:
    """The family that stands out most: its test, corrected p-value, and all families' tests; ``present``: whether it is believed."""

    test: ScoreTest
    p: float
    tests: tuple[ScoreTest, ...]

    @property
    def present(self) -> bool:
        """Whether something unknown is left."""
        return self.p <= ALPHA

    @property
    def stage(self) -> Stage:
        """Where it sits."""
        return self.test.effect.entry.stage


def families(campaign: Campaign, fit: CampaignFit) -> tuple[EffectModel, ...]:
    """The empirical families: the field of force about the middle of the flights, the zoom over the longest sequence."""
    middle = np.mean([flight.x for flight in fit.state.flights], axis=0)
    longest = max(float(np.ptp(sequence.setting.times_s)) for sequence in campaign.sequences)

    def adapted(family: EffectModel) -> EffectModel:
        if isinstance(family, ForceField):
            return family.about(middle)
        return family.over(longest) if isinstance(family, ZoomInTime) else family

    return tuple(adapted(family) for family in EMPIRICAL.values())


def unknown(campaign: Campaign, fit: CampaignFit) -> Unknown:
    """Test what a fit leaves against every empirical family."""
    return outstanding(score_tests(campaign, fit, Candidates.of(campaign, families(campaign, fit))))


def outstanding(tested: Tested) -> Unknown:
    """The family that stands out most of those that were ``tested``."""
    tests, scores = tested
    p = np.array([min(1.0, t.p * len(tests)) for t in tests])
    believed = {i for i in range(len(tests)) if p[i] <= ALPHA}
    order = [h.effect for h in by_remainder(scores, penalty=PENALTY).hypotheses if h.effect in believed]
    chosen = order[0] if order else int(np.argmin(p))
    return Unknown(tests[chosen], float(p[chosen]), tuple(tests))
