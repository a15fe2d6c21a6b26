"""One look at a fit: what the effects of the catalogue and the empirical families would explain there, taken once for all who ask.

The loop asks what to add, the contest what a model leaves, and the last question is for something unknown. The equations behind the answers
are the same, and dear; the tests of some candidates are those of more with the others left out, since each is tested by itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.score_tests import Candidates, EfficientScores, ScoreTest, Tested, score_tests
from estimator.diagnosis.unknown import families
from estimator.effects.choosing import beside
from estimator.effects.link import EffectModel
from estimator.fitting.campaign import Campaign, CampaignFit


@dataclass(frozen=True)
class Look:
    """Tests and scores of all that is not in a model: the first ``known`` of the catalogue, the others families."""

    tests: tuple[ScoreTest, ...]
    scores: EfficientScores
    known: int

    @property
    def catalogue(self) -> Tested:
        """Effects of the catalogue alone."""
        return self._of(range(self.known))

    @property
    def families(self) -> Tested:
        """Families alone."""
        return self._of(range(self.known, len(self.tests)))

    @property
    def lasting(self) -> tuple[Tested, int]:
        """All but what is drawn anew in every frame, which leaves no mean in the scores; and how many of them the catalogue has."""
        wanted = [i for i, test in enumerate(self.tests) if not test.random]
        return self._of(wanted), sum(i < self.known for i in wanted)

    def _of(self, wanted: Sequence[int]) -> Tested:
        number = {old: new for new, old in enumerate(wanted)}
        rows = np.array([i for i, column in enumerate(self.scores.columns) if column.effect in number], dtype=np.int64)
        scores = self.scores.take(rows)
        renamed = tuple(replace(column, effect=number[column.effect]) for column in scores.columns)
        tests = [
            replace(self.tests[i], columns=tuple(replace(column, effect=number[i]) for column in self.tests[i].columns)) for i in wanted
        ]
        return tests, replace(scores, columns=renamed)


class Looks:
    """Looks with one ``catalogue``; those that were asked for last are remembered."""

    REMEMBERED = 6

    def __init__(self, catalogue: Mapping[str, EffectModel]) -> None:
        self.catalogue = catalogue
        self._last: list[tuple[Campaign, CampaignFit, Look]] = []

    def at(self, campaign: Campaign, fit: CampaignFit) -> Look:
        """The look at a fit."""
        for place, (there, seen, look) in enumerate(self._last):
            if there is campaign and seen is fit:
                self._last.append(self._last.pop(place))
                return look
        known = Candidates.of(campaign, beside(fit.model.keys, self.catalogue))
        wide = Candidates.of(campaign, (e for e in families(campaign, fit) if e.entry.key not in fit.model.keys))
        tests, scores = score_tests(campaign, fit, Candidates(known.effects + wide.effects, known.starts + wide.starts))
        look = Look(tuple(tests), scores, len(known.effects))
        self._last = [*self._last[1 - self.REMEMBERED :], (campaign, fit, look)]
        return look
