"""Refits of a campaign with one effect more, or two, and what the scores of all other effects say is left then."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.extending import fit_extended
from estimator.diagnosis.ranking import by_remainder, misfit_unit, surprise_of
from estimator.diagnosis.score_tests import Candidates, EfficientScores, ScoreTest, score_tests
from estimator.fitting.campaign import Campaign, CampaignFit, cost_like
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
FEWEST = np.exp(np.e)
"""Measurements, of which the penalty is Akaike's 2."""
NO_SCORES = EfficientScores((), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))


@dataclass(frozen=True)
class Rules:
    """When to believe.

    ``alpha``: p-value, corrected for the number of candidates, below which an effect is taken for missing. ``margin``: difference of the
    criterion within which effects cannot be told apart. ``shortlist``: effects refitted per step; ``window``: criterion above the
    best within which they are; ``pairs``: pairs refitted where one effect is not enough, so many that a look at the fit without both
    proposes and so many that looks beside one of them do; ``mates``: rivals refitted in place of each of a pair. ``most_effects`` a model
    may gain. ``superfluous``: p-value above which an effect is dropped again.
    """

    alpha: float = 0.01
    margin: float = 6.0
    shortlist: int = 4
    window: float = 40.0
    pairs: int = 2
    mates: int = 3
    most_effects: int = 6
    superfluous: float = 0.05


def penalty_of(campaign: Campaign) -> float:
    """Penalty per parameter among known effects: ``2 ln ln n`` of n independent measurements [Hannan and Quinn 1979], 2 at least."""
    return float(2.0 * np.log(np.log(max(campaign.kind.independent(campaign), FEWEST))))


@dataclass(frozen=True)
class Refitted:
    """A refit with an effect more, of ``parameters`` in the whole campaign.

    ``group``: keys of the effects that it cannot be told from, its own first. ``others`` and ``scores``: the tests of all other effects
    beside it; ``left``: chi-squared of what those scores say is left, of ``columns`` degrees of freedom. ``surprise`` at its value, where
    nature hardly produces it. ``evidence`` is what the data say against it among others, ``criterion`` that with the surprise.
    """

    test: ScoreTest
    group: tuple[str, ...]
    fit: CampaignFit
    left: float
    columns: int
    parameters: int
    others: tuple[ScoreTest, ...] = ()
    scores: EfficientScores = NO_SCORES
    surprise: float = 0.0
    evidence: float = np.inf
    criterion: float = np.inf

    @property
    def flew(self) -> bool:
        """Whether the fit was not led astray."""
        return bool(np.isfinite(self.left))

    @property
    def holds_it(self) -> bool:
        """Whether there is a fit with the effect at all: flights under it did not run away."""
        return key_of(self) in self.fit.model.keys


def key_of(refitted: Refitted) -> str:
    """The added effect."""
    return refitted.test.effect.entry.key


def judged(refits: Sequence[Refitted], penalty: float) -> list[Refitted]:
    """Refits by ascending criterion, what they leave counted in units of the least that any leaves per degree of freedom.

    See :func:`estimator.diagnosis.ranking.misfit_unit`.
    """
    unit = misfit_unit((r.left, r.columns) for r in refits)
    found = [replace(r, evidence=r.left / unit + penalty * r.parameters) for r in refits]
    return sorted((replace(r, criterion=r.evidence + r.surprise) for r in found), key=lambda r: r.criterion)


def refit(campaign: Campaign, fit: CampaignFit, tests: Sequence[ScoreTest], number: int) -> Refitted:
    """Refit with effect ``number`` of ``tests``, and what the scores of all the others say is left: infinitely much if led astray."""
    test = tests[number]
    astray = Refitted(test, (test.effect.entry.key,), fit, np.inf, 0, len(test.columns))
    try:
        new = fit_extended(campaign, fit, test)
        astray = replace(astray, fit=new)
        if cost_like(campaign, new, fit) > fit.cost:
            return astray
        with np.errstate(over="ignore", invalid="ignore"):  # of effects that cannot be flown from there
            found = _looked(campaign, astray, [t for i, t in enumerate(tests) if i != number])
    except (RanAway, np.linalg.LinAlgError):
        return astray
    return replace(found, surprise=surprise_of(test, _values(new, test)))


def refit_pair(campaign: Campaign, fit: CampaignFit, pair: tuple[ScoreTest, ScoreTest], tests: Sequence[ScoreTest]) -> Refitted | None:
    """Refit with those of a pair that ``fit`` lacks; ``None`` where flights under it run away: what cannot be flown explains nothing.

    Its surprise is that of both values.
    """
    keys = [test.effect.entry.key for test in pair]
    try:
        new = fit_extended(campaign, fit, *(test for test, key in zip(pair, keys, strict=True) if key not in fit.model.keys))
        both = Refitted(pair[1], (), new, np.inf, 0, sum(len(test.columns) for test in pair))
        found = _looked(campaign, both, [t for t in tests if t.effect.entry.key not in keys])
    except (RanAway, np.linalg.LinAlgError):
        return None
    return replace(found, surprise=sum(surprise_of(test, _values(new, test)) for test in pair))


def _looked(campaign: Campaign, refitted: Refitted, tests: Sequence[ScoreTest]) -> Refitted:
    """With what the scores of ``tests`` say is left at the fit."""
    others, scores = score_tests(campaign, refitted.fit, _at_their_best(tests))
    ranking = by_remainder(scores, penalty=0.0)
    return replace(refitted, left=ranking.nothing, columns=ranking.columns, others=tuple(others), scores=scores)


def _at_their_best(tests: Sequence[ScoreTest]) -> Candidates:
    """The effects of tests, each at its best starts alone; none that are drawn anew in every frame, or of which the data show nothing."""
    tests = [t for t in tests if t.starts and not t.random]
    return Candidates(tuple(t.effect for t in tests), tuple(np.unique(np.stack(list(t.starts.values())), axis=0) for t in tests))


def _values(fit: CampaignFit, test: ScoreTest) -> Array:
    """Fitted values (c,) of a test's columns."""
    part = fit.model.slices[fit.model.keys.index(test.effect.entry.key)]
    return np.array([fit.state.theta[column.sequence or 0][part][column.parameter] for column in test.columns])
